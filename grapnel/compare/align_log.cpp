#include "grapnel/compare/align_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

constexpr double kHuber = 1.345;             // 95 % efficiency for normal noise (Huber 1981)
constexpr double kNormalMad = 1.4826;        // standard deviation of normal noise per median absolute deviation
constexpr double kFinestStep = 1e-7;         // [s]
constexpr std::size_t kMostSamples = 20000;  // of a quantity in the search
constexpr std::size_t kFewSamples = 3000;    // for the selection among candidates
constexpr std::size_t kMostSteps = 20000;    // of the coarse search
constexpr std::size_t kCandidates = 6;
constexpr double kNearlyAsWell = 8;  // difference of the sum of losses, in units of the mean loss of a sample

double huber(double z) {
  const double a = std::abs(z);
  return a <= kHuber ? a * a / 2 : kHuber * (a - kHuber / 2);
}

Quaterniond quaternion_at(std::span<const double> q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

// From orientation a to b, in the axes of b; NaN where either is missing.
Vector3d rotation_vector_between(const Quaterniond& a, const Quaterniond& b) {
  const Quaterniond d = conjugate(a) * b;
  const double s = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  const double angle = 2 * std::atan2(s, std::abs(d.w));
  const double factor = s > 0 ? std::copysign(angle / s, d.w) : 0;
  return {factor * d.x, factor * d.y, factor * d.z};
}

// The standard deviation of white noise on a smooth signal, from second differences, for samples at similar intervals.
double noise_of(const ComparedQuantity& quantity, std::size_t component) {
  const std::size_t width = quantity.curve.width(), column = quantity.is_orientation ? component + 1 : component;
  const double factor = quantity.is_orientation ? 2 : 1;  // small angles, from the vector part of a quaternion
  std::vector<double> seconds, values;
  for (std::size_t i = 0; i < quantity.samples(); ++i) {
    const double x = factor * quantity.measured[i * width + column];
    if (std::isfinite(x)) values.push_back(x);
  }
  for (std::size_t i = 1; i + 1 < values.size(); ++i)
    seconds.push_back(std::abs(values[i - 1] - 2 * values[i] + values[i + 1]));
  const double noise = seconds.empty() ? 0 : kNormalMad * median_of(seconds) / std::sqrt(6.0);
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double range = values.empty() ? 0 : *most - *least;
  return std::max({noise, 1e-6 * range, std::numeric_limits<double>::min()});
}

// One quantity, prepared for the search.
class SearchedQuantity {
 public:
  explicit SearchedQuantity(const ComparedQuantity& quantity)
      : quantity_(quantity), width_(quantity.residual_width()), scale_(width_), alone_(quantity.samples() * width_) {
    for (std::size_t c = 0; c < width_; ++c)
      scale_[c] = quantity.uncertainty ? *quantity.uncertainty : noise_of(quantity, c);
    set_alone();
  }

  std::size_t samples() const { return quantity_.samples(); }
  const ComparedQuantity& quantity() const { return quantity_; }

  // The loss at an offset over every stride-th sample.
  double loss(double offset, std::size_t stride) {
    double sum = 0;
    for (std::size_t c = 0; c < width_; ++c) residuals_[c].clear();
    for (std::size_t i = 0; i < samples(); i += stride) {
      residual_of(quantity_, i, quantity_.time[i] + offset, {one_.data(), width_});
      for (std::size_t c = 0; c < width_; ++c) {
        if (std::isfinite(one_[c]))
          residuals_[c].push_back(one_[c]);
        else if (std::isfinite(alone_[i * width_ + c]))
          sum += alone_[i * width_ + c];
      }
    }
    for (std::size_t c = 0; c < width_; ++c) sum += loss_of(residuals_[c], scale_[c]);
    return sum;
  }

  // Adds the information on the offset [1/s^2], and the squares of the spread of the residuals in units of the scale.
  void inform(double offset, double& information, std::vector<double>& spreads) {
    std::vector<std::vector<double>> slopes(width_);
    for (std::size_t c = 0; c < width_; ++c) residuals_[c].clear();
    for (std::size_t i = 0; i < samples(); ++i) {
      const double time = quantity_.time[i] + offset;
      residual_of(quantity_, i, time, {one_.data(), width_});
      if (!std::isfinite(one_[0])) continue;
      const std::array<double, 3> rate = orientation_rate(time);
      std::vector<double> slope(quantity_.curve.width());
      if (!quantity_.is_orientation) quantity_.curve.slope(time, slope);
      for (std::size_t c = 0; c < width_; ++c) {
        const double v = quantity_.is_orientation ? rate[c] : slope[c];
        if (!std::isfinite(one_[c]) || !std::isfinite(v)) continue;
        residuals_[c].push_back(one_[c]), slopes[c].push_back(v);
      }
    }
    for (std::size_t c = 0; c < width_; ++c)
      inform_component(residuals_[c], slopes[c], scale_[c], information, spreads);
  }

 private:
  // The loss of each sample against a constant.
  void set_alone() {
    const std::size_t width = quantity_.curve.width();
    std::optional<Quaterniond> first;
    for (std::size_t i = 0; i < samples(); ++i) {
      const std::span<const double> x(quantity_.measured.data() + i * width, width);
      if (!quantity_.is_orientation) {
        std::copy(x.begin(), x.end(), alone_.begin() + static_cast<std::ptrdiff_t>(i * width_));
        continue;
      }
      const Quaterniond q = quaternion_at(x);
      if (!first && std::isfinite(q.w)) first = q;
      const Vector3d v = first ? rotation_vector_between(*first, q) : Vector3d{NAN, NAN, NAN};
      for (std::size_t c = 0; c < 3; ++c) alone_[i * 3 + c] = v[static_cast<int>(c)];
    }
    for (std::size_t c = 0; c < width_; ++c) {
      std::vector<double> values;
      for (std::size_t i = 0; i < samples(); ++i) values.push_back(alone_[i * width_ + c]);
      const double middle = median_of(values);
      for (std::size_t i = 0; i < samples(); ++i)
        alone_[i * width_ + c] = huber((alone_[i * width_ + c] - middle) / scale_[c]);
    }
  }

  // Angular velocity in the body's axes; it is the rate at which the residual decreases with the offset.
  std::array<double, 3> orientation_rate(double time) const {
    if (!quantity_.is_orientation) return {};
    std::array<double, 4> q{}, v{};
    quantity_.curve.value(time, q);
    quantity_.curve.slope(time, v);
    const Quaterniond unit = quaternion_at(q);
    const Quaterniond w = conjugate(unit) * Quaterniond{v[0], v[1], v[2], v[3]};
    return {2 * w.x, 2 * w.y, 2 * w.z};
  }

  static double loss_of(std::vector<double>& residuals, double scale) {
    if (residuals.empty()) return 0;
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    const double bias = *middle;
    double sum = 0;
    for (const double r : residuals) sum += huber((r - bias) / scale);
    return sum;
  }

  static void inform_component(const std::vector<double>& residuals, const std::vector<double>& slopes, double scale,
                               double& information, std::vector<double>& spreads) {
    if (residuals.size() < 3) return;
    const double bias = median_of(residuals);
    std::vector<double> deviations;
    double weight = 0, mean = 0, squares = 0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double z = std::abs(residuals[i] - bias) / scale;
      deviations.push_back(z);
      const double w = z <= kHuber ? 1 : kHuber / z;
      weight += w, mean += w * slopes[i], squares += w * slopes[i] * slopes[i];
    }
    mean /= weight;
    information += (squares - weight * mean * mean) / (scale * scale);
    const double spread = kNormalMad * median_of(deviations);
    spreads.push_back(spread * spread);
  }

  const ComparedQuantity& quantity_;
  std::size_t width_;
  std::vector<double> scale_;  // of the residuals' components
  std::vector<double> alone_;
  std::array<double, kMostComponents> one_{};
  std::vector<std::vector<double>> residuals_ = std::vector<std::vector<double>>(width_);
};

struct Candidate {
  double offset, loss;
};

class OffsetSearch {
 public:
  OffsetSearch(std::span<const ComparedQuantity* const> quantities, const OffsetRange& range) : range_(range) {
    for (const ComparedQuantity* one : quantities) {
      parts_.emplace_back(*one);
      fastest_ = std::min(fastest_, one->curve.characteristic_time());
    }
  }

  ClockOffset find() {
    ClockOffset found;
    std::vector<Candidate> candidates = coarse();
    for (Candidate& one : candidates) one = refined(one, step_, step_ / 100, kFewSamples);
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.loss < b.loss; });
    const Candidate best = refined(candidates.front(), step_ / 100, kFinestStep, kMostSamples);
    found.offset = best.offset;
    set_uncertainty(found);
    const double least = candidates.front().loss;
    const double mean = std::max(least / std::max(static_cast<double>(used_), 1.0), 0.5);
    for (const Candidate& one : candidates) {
      const bool is_apart = std::abs(one.offset - best.offset) > 3 * step_;
      if (is_apart && one.loss - least < kNearlyAsWell * mean && !found.other) found.other = one.offset;
    }
    return found;
  }

 private:
  double loss(double offset, std::size_t samples) {
    double sum = 0;
    for (SearchedQuantity& one : parts_) sum += one.loss(offset, std::max<std::size_t>(one.samples() / samples, 1));
    return sum;
  }

  // The best local minima on a grid.
  std::vector<Candidate> coarse() {
    const double length = range_.to - range_.from;
    const double wanted = std::isfinite(fastest_) ? fastest_ / 8 : length / 50;
    const auto steps = static_cast<std::size_t>(
        std::clamp(std::ceil(length / std::max(wanted, 1e-9)), 50.0, static_cast<double>(kMostSteps)));
    step_ = std::max(length / static_cast<double>(steps), kFinestStep);
    const std::size_t samples = std::clamp<std::size_t>(4'000'000 / steps, 200, 2000);
    std::vector<Candidate> grid;
    for (std::size_t k = 0; k <= steps; ++k) {
      const double offset = range_.from + step_ * static_cast<double>(k);
      grid.push_back({offset, loss(offset, samples)});
    }
    std::vector<Candidate> minima;
    for (std::size_t k = 0; k < grid.size(); ++k) {
      const bool left = k == 0 || grid[k].loss <= grid[k - 1].loss;
      const bool right = k + 1 == grid.size() || grid[k].loss <= grid[k + 1].loss;
      if (left && right) minima.push_back(grid[k]);
    }
    std::sort(minima.begin(), minima.end(), [](const Candidate& a, const Candidate& b) { return a.loss < b.loss; });
    minima.resize(std::min(minima.size(), kCandidates));
    return minima;
  }

  // Around a minimum on a grid with this step: grids ten times as fine, again and again.
  Candidate refined(Candidate best, double step, double finest, std::size_t samples) {
    best.loss = loss(best.offset, samples);
    while (step > finest) {
      const double middle = best.offset, fine = step / 10;
      for (int k = -10; k <= 10; ++k) {
        const double offset = std::clamp(middle + k * fine, range_.from, range_.to);
        const double here = loss(offset, samples);
        if (here < best.loss) best = {offset, here};
      }
      step = fine;
    }
    return best;
  }

  void set_uncertainty(ClockOffset& found) {
    double information = 0;
    std::vector<double> spreads;
    for (SearchedQuantity& one : parts_) {
      one.inform(found.offset, information, spreads);
      used_ += one.samples() * one.quantity().residual_width();
    }
    double spread = 0;
    for (const double s : spreads) spread += s / static_cast<double>(spreads.size());
    found.uncertainty =
        information > 0 ? std::sqrt(std::max(spread, 1.0) / information) : std::numeric_limits<double>::infinity();
    const double length = range_.to - range_.from;
    const bool is_at_end = found.offset - range_.from < 2 * kFinestStep || range_.to - found.offset < 2 * kFinestStep;
    if (!(found.uncertainty < 0.1 * length))
      found.why_not =
          "the quantities change at a constant rate or too little, so that an offset has the effect of a bias";
    else if (is_at_end)
      found.why_not =
          fmt::format("the best offset is at an end of the searched range, {:.6g} to {:.6g} s", range_.from, range_.to);
    found.is_determined = found.why_not.empty();
  }

  OffsetRange range_;
  std::vector<SearchedQuantity> parts_;
  std::size_t used_ = 0;
  double fastest_ = std::numeric_limits<double>::infinity();  // [s]
  double step_ = 0;                                           // of the grid [s]
};

}  // namespace

double median_of(std::vector<double> values) {
  std::erase_if(values, [](double x) { return !std::isfinite(x); });
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void residual_of(const ComparedQuantity& quantity, std::size_t sample, double run_time, std::span<double> out) {
  std::array<double, kMostComponents> simulated;
  const std::size_t width = quantity.curve.width();
  const std::span<double> x(simulated.data(), width);
  quantity.curve.value(run_time, x);
  const std::span<const double> measured(quantity.measured.data() + sample * width, width);
  if (!quantity.is_orientation) {
    for (std::size_t c = 0; c < width; ++c) out[c] = measured[c] - x[c];
    return;
  }
  const Vector3d v = rotation_vector_between(quaternion_at(x), quaternion_at(measured));
  for (std::size_t c = 0; c < 3; ++c) out[c] = v[static_cast<int>(c)];
}

OffsetRange possible_offsets(std::span<const ComparedQuantity* const> quantities) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double run_begin = kFar, run_end = -kFar, log_begin = kFar, log_end = -kFar;
  for (const ComparedQuantity* one : quantities) {
    run_begin = std::min(run_begin, one->curve.begin()), run_end = std::max(run_end, one->curve.end());
    log_begin = std::min(log_begin, one->time.front()), log_end = std::max(log_end, one->time.back());
  }
  const double half = std::min(run_end - run_begin, log_end - log_begin) / 2;
  return {run_begin - log_end + half, run_end - log_begin - half};
}

ClockOffset find_offset(std::span<const ComparedQuantity* const> quantities, const OffsetRange& range) {
  return OffsetSearch(quantities, range).find();
}

}  // namespace grapnel
