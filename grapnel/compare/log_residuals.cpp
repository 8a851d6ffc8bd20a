#include "grapnel/compare/log_residuals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

constexpr double kTimeStep = 1e-6;  // of differences in time, relative to the length of the run

double selected_count(const std::vector<bool>& selected) {
  return static_cast<double>(std::count(selected.begin(), selected.end(), true));
}

// 1 / standard deviation of the sum of n residuals over sqrt(n), about a bias with standard uncertainty b; 0 if it is
// free.
double weight_of_mean(double s, double b, double n) { return std::isfinite(b) ? 1 / std::sqrt(s * s + n * b * b) : 0; }

// Residuals by a function (quantity, sample, out), and the whitening of their covariance s^2 1 + b^2 1 1^T: deviations
// from the mean over s, and the mean (26.3).
template <class Residual>
WhiteResiduals whitened(const Quantities& quantities, const Selection& selection, Residual residual) {
  std::vector<double> white, means;
  std::array<double, kMostComponents> one{};
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const ComparedQuantity& quantity = quantities[q];
    if (!quantity.uncertainty) continue;
    const std::size_t width = quantity.residual_width(), first = white.size();
    std::size_t count = 0;
    for (std::size_t i = 0; i < quantity.samples(); ++i) {
      if (!selection[q][i]) continue;
      residual(quantity, i, std::span<double>(one.data(), width));
      white.insert(white.end(), one.begin(), one.begin() + static_cast<std::ptrdiff_t>(width));
      ++count;
    }
    const double n = static_cast<double>(count), s = *quantity.uncertainty, b = quantity.bias_uncertainty.value_or(0);
    for (std::size_t c = 0; c < width; ++c) {
      double mean = 0;
      for (std::size_t i = 0; i < count; ++i) mean += white[first + i * width + c] / n;
      for (std::size_t i = 0; i < count; ++i) white[first + i * width + c] = (white[first + i * width + c] - mean) / s;
      means.push_back(mean);
      white.push_back(count > 0 ? mean * std::sqrt(n) * weight_of_mean(s, b, n) : 0);
    }
  }
  WhiteResiduals result;
  result.white = Eigen::Map<const Eigen::VectorXd>(white.data(), static_cast<Eigen::Index>(white.size()));
  result.means = Eigen::Map<const Eigen::VectorXd>(means.data(), static_cast<Eigen::Index>(means.size()));
  return result;
}

}  // namespace

Selection selected_samples(const FittedLog& log, const Quantities& quantities, const LogClock& clock) {
  Selection selection;
  for (const ComparedQuantity& quantity : quantities) {
    std::vector<bool> used(quantity.samples(), false);
    if (quantity.uncertainty) used = compared_samples(quantity, clock, log.times);
    if (log.fits_offset || log.fits_drift) {
      const double near = median_interval(quantity.time);
      std::vector<double> edges = quantity.curve.jumps();
      edges.push_back(quantity.curve.begin()), edges.push_back(quantity.curve.end());
      for (std::size_t i = 0; i < used.size(); ++i) {
        const double time = clock.run_time(quantity.time[i]);
        for (const double edge : edges) used[i] = used[i] && std::abs(time - edge) > near;
      }
    }
    selection.push_back(std::move(used));
  }
  return selection;
}

LogClock first_clock(const FittedLog& log, const Quantities& quantities, double drift) {
  LogClock clock{log.offset, drift, 0};
  double first = std::numeric_limits<double>::infinity(), last = -first;
  std::vector<const ComparedQuantity*> aligned;
  for (const ComparedQuantity& one : quantities) {
    if (one.time.empty()) continue;
    first = std::min(first, one.time.front()), last = std::max(last, one.time.back());
    if (one.aligns && one.uncertainty) aligned.push_back(&one);
  }
  clock.reference = log.reference.value_or((first + last) / 2);
  if (!log.fits_offset || aligned.empty()) return clock;
  const OffsetRange possible = possible_offsets(aligned);
  const OffsetRange range = log.offset_range ? OffsetRange{(*log.offset_range)[0], (*log.offset_range)[1]} : possible;
  clock.offset = find_offset(aligned, range, {clock.drift, clock.reference, {}}).offset;
  return clock;
}

std::optional<WhiteResiduals> white_residuals(const Quantities& quantities, const LogClock& clock,
                                              const Selection& selection) {
  WhiteResiduals result = whitened(quantities, selection, [&](const ComparedQuantity& q, std::size_t i, auto out) {
    residual_of(q, i, std::clamp(clock.run_time(q.time[i]), q.curve.begin(), q.curve.end()), out);
  });
  if (!result.white.allFinite()) return std::nullopt;
  return result;
}

WhiteResiduals clock_derivative(const Quantities& quantities, const LogClock& clock, const Selection& selection,
                                bool by_drift) {
  std::array<double, kMostComponents> before{};
  return whitened(quantities, selection, [&](const ComparedQuantity& q, std::size_t i, std::span<double> out) {
    const double time = clock.run_time(q.time[i]), step = kTimeStep * (q.curve.end() - q.curve.begin());
    residual_of(q, i, time - step, {before.data(), out.size()});
    residual_of(q, i, time + step, out);
    for (std::size_t c = 0; c < out.size(); ++c) {
      const double rate = (out[c] - before[c]) / (2 * step);
      out[c] = std::isfinite(rate) ? rate * (by_drift ? q.time[i] - clock.reference : 1) : 0;
    }
  });
}

double independent_numbers(const Quantities& quantities, const Selection& selection) {
  double numbers = 0;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (!quantities[q].uncertainty) continue;
    const double count = selected_count(selection[q]);
    const bool is_free = !std::isfinite(quantities[q].bias_uncertainty.value_or(0));
    numbers += std::max(count - (is_free ? 1 : 0), 0.0) * static_cast<double>(quantities[q].residual_width());
  }
  return numbers;
}

std::vector<MeanOf> means_of(const Quantities& quantities, const Selection& selection) {
  std::vector<MeanOf> means;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    if (!quantities[q].uncertainty) continue;
    for (std::size_t c = 0; c < quantities[q].residual_width(); ++c)
      means.push_back({q, c, selected_count(selection[q])});
  }
  return means;
}

}  // namespace grapnel
