#include "grapnel/compare/align_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace grapnel {
namespace {

constexpr double kHuber = 1.345;             // 95 % efficiency for normal noise (Huber 1981)
constexpr double kNormalMad = 1.4826;        // standard deviation of normal noise per median absolute deviation
constexpr double kFinestStep = 1e-7;         // [s]
constexpr std::size_t kMostSamples = 20000;  // of a quantity in the search
constexpr std::size_t kFewSamples = 3000;    // for the selection among candidates
constexpr std::size_t kMostSteps = 20000;    // of the coarse search
constexpr std::size_t kCandidates = 6;
constexpr double kMostDrifts = 20;   // of either sign in the coarse search
constexpr int kMostRounds = 10;      // of offset and drift in turn
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

// The information matrix of offset [1/s^2] and drift, at the reference of the clock.
struct ClockInformation {
  double offset = 0, mixed = 0, drift = 0;
};

// The place of a sample among those of the same time, and their number.
std::pair<std::size_t, std::size_t> rank_at_time(const std::vector<double>& time, std::size_t sample) {
  const bool is_first = sample == 0 || time[sample - 1] != time[sample];
  const bool is_last = sample + 1 == time.size() || time[sample + 1] != time[sample];
  if (is_first && is_last) return {0, 1};
  const auto [begin, end] = std::equal_range(time.begin(), time.end(), time[sample]);
  const auto at = time.begin() + static_cast<std::ptrdiff_t>(sample);
  return {static_cast<std::size_t>(at - begin), static_cast<std::size_t>(end - begin)};
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

  // The loss with a clock over every stride-th sample.
  double loss(const LogClock& clock, std::size_t stride) {
    double sum = 0;
    for (std::size_t c = 0; c < width_; ++c) residuals_[c].clear();
    for (std::size_t i = 0; i < samples(); i += stride) {
      residual_of(quantity_, i, clock.run_time(quantity_.time[i]), {one_.data(), width_});
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

  // Adds the information on offset and drift, and the squares of the spread of the residuals in units of the scale.
  void inform(const LogClock& clock, ClockInformation& information, std::vector<double>& spreads) {
    std::vector<std::vector<double>> slopes(width_), times(width_);
    for (std::size_t c = 0; c < width_; ++c) residuals_[c].clear();
    for (std::size_t i = 0; i < samples(); ++i) {
      const double time = clock.run_time(quantity_.time[i]);
      residual_of(quantity_, i, time, {one_.data(), width_});
      if (!std::isfinite(one_[0])) continue;
      const std::array<double, 3> rate = orientation_rate(time);
      std::vector<double> slope(quantity_.curve.width());
      if (!quantity_.is_orientation) quantity_.curve.slope(time, slope);
      for (std::size_t c = 0; c < width_; ++c) {
        const double v = quantity_.is_orientation ? rate[c] : slope[c];
        if (!std::isfinite(one_[c]) || !std::isfinite(v)) continue;
        residuals_[c].push_back(one_[c]), slopes[c].push_back(v);
        times[c].push_back(quantity_.time[i] - clock.reference);
      }
    }
    for (std::size_t c = 0; c < width_; ++c)
      inform_component(residuals_[c], slopes[c], times[c], scale_[c], information, spreads);
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

  static void inform_component(const std::vector<double>& residuals, const std::vector<double>& slopes,
                               const std::vector<double>& times, double scale, ClockInformation& information,
                               std::vector<double>& spreads) {
    if (residuals.size() < 3) return;
    const double bias = median_of(residuals);
    std::vector<double> deviations;
    double weight = 0, mean = 0, mean_drift = 0;
    ClockInformation sum;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double z = std::abs(residuals[i] - bias) / scale;
      deviations.push_back(z);
      const double w = z <= kHuber ? 1 : kHuber / z, v = slopes[i], d = slopes[i] * times[i];
      weight += w, mean += w * v, mean_drift += w * d;
      sum.offset += w * v * v, sum.mixed += w * v * d, sum.drift += w * d * d;
    }
    mean /= weight, mean_drift /= weight;  // the bias of the component is free
    const double s2 = scale * scale;
    information.offset += (sum.offset - weight * mean * mean) / s2;
    information.mixed += (sum.mixed - weight * mean * mean_drift) / s2;
    information.drift += (sum.drift - weight * mean_drift * mean_drift) / s2;
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

// A clock, with the offset at the search's centre.
struct Candidate {
  double offset, loss, drift = 0;
};

class OffsetSearch {
 public:
  OffsetSearch(std::span<const ComparedQuantity* const> quantities, const OffsetRange& range, const ClockDrift& drift)
      : range_(range), given_(drift), centre_(drift.reference) {
    double begin = std::numeric_limits<double>::infinity(), end = -begin;
    for (const ComparedQuantity* one : quantities) {
      parts_.emplace_back(*one);
      fastest_ = std::min(fastest_, one->curve.characteristic_time());
      begin = std::min(begin, one->time.front()), end = std::max(end, one->time.back());
    }
    half_ = std::max((end - begin) / 2, kFinestStep);
    if (given_.largest) centre_ = (begin + end) / 2;
  }

  ClockOffset find() {
    ClockOffset found;
    std::vector<Candidate> candidates = coarse();
    for (Candidate& one : candidates) one = refined(one, step_, step_ / 100, kFewSamples);
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.loss < b.loss; });
    centre_on_information(candidates);
    const Candidate best = refined(candidates.front(), step_ / 100, kFinestStep, kMostSamples);
    found.offset = best.offset, found.drift = best.drift;
    const double least = candidates.front().loss;
    for (const SearchedQuantity& one : parts_) used_ += one.samples() * one.quantity().residual_width();
    const double mean = std::max(least / std::max(static_cast<double>(used_), 1.0), 0.5);
    for (const Candidate& one : candidates) {
      const bool is_apart = std::abs(one.offset - candidates.front().offset) > 3 * step_;
      // At the reference, with its drift.
      if (is_apart && one.loss - least < kNearlyAsWell * mean && !found.other)
        found.other = one.offset + one.drift * (given_.reference - centre_);
    }
    set_uncertainty(found);
    return found;
  }

 private:
  double loss(const Candidate& one, std::size_t samples) {
    const LogClock clock{one.offset, one.drift, centre_};
    double sum = 0;
    for (SearchedQuantity& part : parts_) sum += part.loss(clock, std::max<std::size_t>(part.samples() / samples, 1));
    return sum;
  }

  // The drifts of the coarse search: their effect at the ends of the log differs by less than a step.
  std::vector<double> coarse_drifts() const {
    if (!given_.largest) return {given_.value};
    const double effect = *given_.largest * half_;
    const auto pairs = static_cast<int>(std::min(std::floor(effect / step_), kMostDrifts));
    std::vector<double> drifts{0};
    for (int k = 1; k <= pairs; ++k) {
      const double one = *given_.largest * k / (pairs + 1);
      drifts.push_back(one), drifts.push_back(-one);
    }
    return drifts;
  }

  // The best local minima on a grid.
  std::vector<Candidate> coarse() {
    const double length = range_.to - range_.from;
    const double wanted = std::isfinite(fastest_) ? fastest_ / 8 : length / 50;
    const auto steps = static_cast<std::size_t>(
        std::clamp(std::ceil(length / std::max(wanted, 1e-9)), 50.0, static_cast<double>(kMostSteps)));
    step_ = std::max(length / static_cast<double>(steps), kFinestStep);
    const std::vector<double> drifts = coarse_drifts();
    const std::size_t samples = std::clamp<std::size_t>(4'000'000 / (steps * drifts.size()), 200, 2000);
    std::vector<Candidate> minima;
    for (const double drift : drifts) {
      std::vector<Candidate> grid;
      for (std::size_t k = 0; k <= steps; ++k) {
        grid.push_back({range_.from + step_ * static_cast<double>(k), 0, drift});
        grid.back().loss = loss(grid.back(), samples);
      }
      for (std::size_t k = 0; k < grid.size(); ++k) {
        const bool left = k == 0 || grid[k].loss <= grid[k - 1].loss;
        const bool right = k + 1 == grid.size() || grid[k].loss <= grid[k + 1].loss;
        if (left && right) minima.push_back(grid[k]);
      }
    }
    std::sort(minima.begin(), minima.end(), [](const Candidate& a, const Candidate& b) { return a.loss < b.loss; });
    minima.resize(std::min(minima.size(), kCandidates));
    return minima;
  }

  // Around a minimum on a grid with this step: grids ten times as fine, again and again.
  Candidate refined(Candidate best, double step, double finest, std::size_t samples) {
    best.loss = loss(best, samples);
    while (step > finest) {
      const double fine = step / 10;
      for (int round = 0; round < (given_.largest ? kMostRounds : 1); ++round) {
        const Candidate before = best;
        search_line(best, fine, 0, samples);
        if (!given_.largest) break;
        search_line(best, 0, fine / half_, samples);
        if (best.offset == before.offset && best.drift == before.drift) break;
      }
      step = fine;
    }
    return best;
  }

  void search_line(Candidate& best, double offset_step, double drift_step, std::size_t samples) {
    const Candidate middle = best;
    for (int k = -10; k <= 10; ++k) {
      Candidate here = middle;
      if (offset_step > 0) here.offset = std::clamp(middle.offset + k * offset_step, range_.from, range_.to);
      if (drift_step > 0) here.drift = std::clamp(middle.drift + k * drift_step, -*given_.largest, *given_.largest);
      here.loss = loss(here, samples);
      if (here.loss < best.loss) best = here;
    }
  }

  ClockInformation information_at(const Candidate& one, double& spread) {
    ClockInformation information;
    std::vector<double> spreads;
    for (SearchedQuantity& part : parts_) part.inform({one.offset, one.drift, centre_}, information, spreads);
    spread = 0;
    for (const double s : spreads) spread += s / static_cast<double>(spreads.size());
    spread = std::max(spread, 1.0);
    return information;
  }

  // Moves the centre to the time at which offset and drift of the first candidate are uncorrelated, so that they can be
  // refined in turn.
  void centre_on_information(std::vector<Candidate>& candidates) {
    if (!given_.largest) return;
    double spread = 0;
    const ClockInformation n = information_at(candidates.front(), spread);
    const double shift = n.offset > 0 ? std::clamp(n.mixed / n.offset, -half_, half_) : 0;
    centre_ += shift;
    for (Candidate& one : candidates) one.offset += one.drift * shift;
  }

  // The offset from the search's centre to the reference, and the standard uncertainties from the inverse of the
  // information matrix.
  void set_uncertainty(ClockOffset& found) {
    const Candidate best{found.offset, 0, found.drift};
    double spread = 0;
    const ClockInformation n = information_at(best, spread);
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    const double shift = given_.reference - centre_;
    double variance = n.offset > 0 ? spread / n.offset : kUnknown;
    if (given_.largest) {
      const double determinant = n.offset * n.drift - n.mixed * n.mixed;
      const bool is_regular = determinant > 1e-12 * n.offset * n.drift;
      const double of_drift = is_regular ? spread * n.offset / determinant : kUnknown;
      const double of_both = is_regular ? -spread * n.mixed / determinant : 0;
      found.drift_uncertainty = std::sqrt(of_drift);
      if (is_regular) variance = spread * n.drift / determinant + 2 * shift * of_both + shift * shift * of_drift;
    }
    found.uncertainty = std::sqrt(variance);
    found.why_not = why_not(found, best);
    found.is_determined = found.why_not.empty();
    found.offset += found.drift * shift;
  }

  std::string why_not(const ClockOffset& found, const Candidate& best) const {
    const double length = range_.to - range_.from;
    const auto is_near = [](double a, double b, double step) { return std::abs(a - b) < 2 * step; };
    if (given_.largest) {
      const double most = *given_.largest;
      if (!(found.drift_uncertainty < 0.2 * most))
        return fmt::format(
            "the drift is not determined: its standard uncertainty of {:.3g} ppm exceeds a fifth of the largest "
            "searched drift, {:.3g} ppm, as for short logs",
            1e6 * found.drift_uncertainty, 1e6 * most);
      if (is_near(std::abs(best.drift), most, kFinestStep / half_))
        return fmt::format("the best drift is at an end of the searched range, {:.4g} ppm", 1e6 * best.drift);
    }
    double run = 0;  // its length
    for (const SearchedQuantity& one : parts_) {
      const RunCurve& curve = one.quantity().curve;
      run = std::max(run, curve.end() - curve.begin());
    }
    constexpr double kMuchLonger = 20;
    const std::string_view units = 2 * half_ > kMuchLonger * run ? "; is the unit of the log's times right?" : "";
    if (!(found.uncertainty < 0.1 * run))
      return fmt::format(
          "no offset fits clearly better than others, as where quantities change at a constant rate, or "
          "too little{}",
          units);
    if (is_near(best.offset, range_.from, kFinestStep) || is_near(best.offset, range_.to, kFinestStep))
      return fmt::format("the best offset is at an end of the searched range, {:.6g} to {:.6g} s", range_.from,
                         range_.to);
    if (!(found.uncertainty < 0.1 * length))
      return fmt::format("its standard uncertainty of {:.3g} s exceeds a tenth of the searched range",
                         found.uncertainty);
    return {};
  }

  OffsetRange range_;
  ClockDrift given_;
  double centre_;    // time of the log to which offsets of candidates refer [s]
  double half_ = 0;  // half of the log's length [s]
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

double median_interval(std::span<const double> time) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < time.size(); ++i) {
    if (time[i] > time[i - 1]) intervals.push_back(time[i] - time[i - 1]);
  }
  return median_of(std::move(intervals));
}

void residual_of(const ComparedQuantity& quantity, std::size_t sample, double run_time, std::span<double> out) {
  std::array<double, kMostComponents> simulated;
  const std::size_t width = quantity.curve.width();
  const std::span<double> x(simulated.data(), width);
  const auto [rank, count] = rank_at_time(quantity.time, sample);
  if (count == 1 || !quantity.curve.value_at_jump(run_time, rank, count, x)) quantity.curve.value(run_time, x);
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

ClockOffset find_offset(std::span<const ComparedQuantity* const> quantities, const OffsetRange& range,
                        const ClockDrift& drift) {
  return OffsetSearch(quantities, range, drift).find();
}

}  // namespace grapnel
