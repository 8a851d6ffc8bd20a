#include "grapnel/compare/run_curve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace grapnel {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Cubic from the values and slopes at the ends of an interval of length h, at the share s of it.
double hermite(double a, double b, double slope_a, double slope_b, double h, double s) {
  const double r = 1 - s;
  return r * r * ((1 + 2 * s) * a + s * h * slope_a) + s * s * ((1 + 2 * r) * b - r * h * slope_b);
}
double hermite_slope(double a, double b, double slope_a, double slope_b, double h, double s) {
  const double r = 1 - s;
  return 6 * s * r * (b - a) / h + r * (1 - 3 * s) * slope_a + s * (3 * s - 2) * slope_b;
}
// From the beginning of the interval to the share s of it.
double hermite_integral(double a, double b, double slope_a, double slope_b, double h, double s) {
  const double s2 = s * s, s3 = s2 * s, s4 = s3 * s;
  return h * ((s4 / 2 - s3 + s) * a + (s3 - s4 / 2) * b) +
         h * h * ((s4 / 4 - 2 * s3 / 3 + s2 / 2) * slope_a + (s4 / 4 - s3 / 3) * slope_b);
}

}  // namespace

RunCurve::RunCurve(std::vector<double> time, std::vector<double> values, std::size_t width)
    : width_(width), time_(std::move(time)), values_(std::move(values)) {
  set_slopes();
}

RunCurve RunCurve::averaged(double window) const {
  RunCurve curve = *this;
  curve.window_ = window;
  if (window > 0) curve.add_integral();
  return curve;
}

double RunCurve::begin() const { return time_.empty() ? kNone : time_.front() + window_; }
double RunCurve::end() const { return time_.empty() ? kNone : time_.back(); }

std::vector<double> RunCurve::jumps() const {
  std::vector<double> jumps;
  for (std::size_t k = 1; k < time_.size(); ++k) {
    if (!(time_[k] > time_[k - 1]) && (jumps.empty() || jumps.back() != time_[k])) jumps.push_back(time_[k]);
  }
  return jumps;
}

// The interval that contains the time; at a jump the one after it. The number of samples if there is none.
std::size_t RunCurve::interval_at(double time) const {
  const std::size_t none = time_.size();
  if (time_.size() < 2 || !(time >= time_.front()) || !(time <= time_.back())) return none;
  auto after = std::upper_bound(time_.begin(), time_.end(), time);
  if (after == time_.end()) after = std::lower_bound(time_.begin(), time_.end(), time_.back());
  if (after == time_.begin()) return none;
  return static_cast<std::size_t>(after - time_.begin()) - 1;
}

bool RunCurve::connects(std::size_t i, std::size_t j) const { return time_[j] > time_[i]; }

void RunCurve::set_slopes() {
  slopes_.assign(values_.size(), 0.0);
  const std::size_t n = time_.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t c = 0; c < width_; ++c) {
      const auto x = [&](std::size_t i) { return values_[i * width_ + c]; };
      const auto has = [&](std::size_t i, std::size_t j) {
        return connects(i, j) && std::isfinite(x(i)) && std::isfinite(x(j));
      };
      const auto secant = [&](std::size_t i) { return (x(i + 1) - x(i)) / (time_[i + 1] - time_[i]); };
      const auto length = [&](std::size_t i) { return time_[i + 1] - time_[i]; };
      double& slope = slopes_[k * width_ + c];
      const bool before = k > 0 && has(k - 1, k), after = k + 1 < n && has(k, k + 1);
      if (before && after) {
        slope = (length(k) * secant(k - 1) + length(k - 1) * secant(k)) / (length(k - 1) + length(k));
      } else if (after) {
        const bool more = k + 2 < n && has(k + 1, k + 2);
        slope = secant(k);
        if (more) slope -= (secant(k + 1) - secant(k)) * length(k) / (length(k) + length(k + 1));
      } else if (before) {
        const bool more = k > 1 && has(k - 2, k - 1);
        slope = secant(k - 1);
        if (more) slope += (secant(k - 1) - secant(k - 2)) * length(k - 1) / (length(k - 1) + length(k - 2));
      }
    }
  }
}

void RunCurve::add_integral() {
  integral_.assign(values_.size(), 0.0);
  holes_.assign(values_.size(), 0);
  for (std::size_t k = 0; k + 1 < time_.size(); ++k) {
    const double h = time_[k + 1] - time_[k];
    for (std::size_t c = 0; c < width_; ++c) {
      const std::size_t i = k * width_ + c, j = i + width_;
      const double part = h > 0 ? hermite_integral(values_[i], values_[j], slopes_[i], slopes_[j], h, 1.0) : 0.0;
      integral_[j] = integral_[i] + (std::isfinite(part) ? part : 0.0);
      holes_[j] = holes_[i] + (std::isfinite(part) ? 0 : 1);
    }
  }
}

double RunCurve::at(std::size_t interval, std::size_t component, double time) const {
  const std::size_t i = interval * width_ + component, j = i + width_;
  if (time == time_[interval]) return values_[i];  // the other end may have no value
  if (time == time_[interval + 1]) return values_[j];
  const double h = time_[interval + 1] - time_[interval];
  return hermite(values_[i], values_[j], slopes_[i], slopes_[j], h, (time - time_[interval]) / h);
}

double RunCurve::slope_at(std::size_t interval, std::size_t component, double time) const {
  const std::size_t i = interval * width_ + component, j = i + width_;
  const double h = time_[interval + 1] - time_[interval];
  return hermite_slope(values_[i], values_[j], slopes_[i], slopes_[j], h, (time - time_[interval]) / h);
}

double RunCurve::integral_to(std::size_t interval, std::size_t component, double time) const {
  const std::size_t i = interval * width_ + component, j = i + width_;
  const double h = time_[interval + 1] - time_[interval];
  return integral_[i] +
         hermite_integral(values_[i], values_[j], slopes_[i], slopes_[j], h, (time - time_[interval]) / h);
}

// A time => `single` of the interval that contains it, or of an averaged curve `over` the window that ends there; NaN
// outside the curve.
template <class Single, class Over>
void RunCurve::evaluate(double time, std::span<double> out, Single single, Over over) const {
  const std::size_t last = interval_at(time), first = window_ > 0 ? interval_at(time - window_) : last;
  const bool is_inside = last != time_.size() && first != time_.size();
  for (std::size_t c = 0; c < width_; ++c)
    out[c] = !is_inside ? kNone : window_ > 0 ? over(first, last, c) : single(last, c);
}

void RunCurve::value(double time, std::span<double> out) const {
  evaluate(
      time, out, [&](std::size_t i, std::size_t c) { return at(i, c, time); },
      [&](std::size_t first, std::size_t last, std::size_t c) {
        const bool has_hole = holes_[(last + 1) * width_ + c] > holes_[first * width_ + c];
        return has_hole ? kNone : (integral_to(last, c, time) - integral_to(first, c, time - window_)) / window_;
      });
}

bool RunCurve::value_at_jump(double time, std::size_t place, std::size_t count, std::span<double> out) const {
  const auto [first, last] = std::equal_range(time_.begin(), time_.end(), time);
  if (window_ > 0 || static_cast<std::size_t>(last - first) != count) return false;
  const std::size_t sample = static_cast<std::size_t>(first - time_.begin()) + place;
  for (std::size_t c = 0; c < width_; ++c) out[c] = values_[sample * width_ + c];
  return true;
}

bool RunCurve::has_sample_at(double time) const {
  return !(window_ > 0) && std::binary_search(time_.begin(), time_.end(), time);
}

void RunCurve::slope(double time, std::span<double> out) const {
  evaluate(
      time, out, [&](std::size_t i, std::size_t c) { return slope_at(i, c, time); },
      [&](std::size_t first, std::size_t last, std::size_t c) {
        return (at(last, c, time) - at(first, c, time - window_)) / window_;
      });
}

std::vector<double> RunCurve::interpolation_error() const {
  std::vector<double> sums(width_, 0.0), thinned_time, thinned_values;
  std::vector<std::size_t> left_out;
  const std::size_t n = time_.size();
  std::size_t since = 0;  // samples since the beginning of the smooth part
  for (std::size_t k = 0; k < n; ++k) {
    since = k > 0 && connects(k - 1, k) ? since + 1 : 0;
    const bool is_inside = since > 0 && k + 1 < n && connects(k, k + 1);
    if (is_inside && since % 2 == 1) {
      left_out.push_back(k);
      continue;
    }
    thinned_time.push_back(time_[k]);
    for (std::size_t c = 0; c < width_; ++c) thinned_values.push_back(values_[k * width_ + c]);
  }
  if (left_out.size() < 2) return std::vector<double>(width_, kNone);
  const RunCurve thinned(std::move(thinned_time), std::move(thinned_values), width_);
  std::vector<double> x(width_);
  std::size_t count = 0;
  for (const std::size_t k : left_out) {
    thinned.value(time_[k], x);
    bool complete = true;
    for (std::size_t c = 0; c < width_; ++c) complete = complete && std::isfinite(x[c] - values_[k * width_ + c]);
    if (!complete) continue;
    ++count;
    for (std::size_t c = 0; c < width_; ++c) {
      const double error = x[c] - values_[k * width_ + c];
      sums[c] += error * error;
    }
  }
  for (double& sum : sums) sum = count > 0 ? std::sqrt(sum / static_cast<double>(count)) / 8 : kNone;
  return sums;
}

double RunCurve::characteristic_time() const {
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < width_; ++c) {
    double weight = 0, sum = 0, squares = 0, slopes = 0;
    for (std::size_t k = 0; k + 1 < time_.size(); ++k) {
      const double h = time_[k + 1] - time_[k], x = values_[k * width_ + c], v = slopes_[k * width_ + c];
      if (!(h > 0) || !std::isfinite(x)) continue;
      weight += h, sum += h * x, squares += h * x * x, slopes += h * v * v;
    }
    if (!(weight > 0) || !(slopes > 0)) continue;
    const double spread = std::sqrt(std::max(squares / weight - (sum / weight) * (sum / weight), 0.0));
    const double time = spread / std::sqrt(slopes / weight);
    if (time > 0) shortest = std::min(shortest, time);
  }
  return shortest;
}

}  // namespace grapnel
