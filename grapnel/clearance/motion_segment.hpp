#pragma once

/// @file
/// Motion between two samples of a state. Inside this module only.

#include <cmath>
#include <vector>

#include "grapnel/dynamics/state.hpp"

namespace grapnel {

// Zero and minimum of a function of one variable.

/// Where f changes sign between `low` and `high`, to about 1e-13 of their distance; `low_value` is f(low). Calls
/// f(double) -> double.
template <class Function>
double crossing(Function&& f, double low, double high, double low_value) {
  for (int step = 0; step < 44; ++step) {
    const double middle = 0.5 * (low + high);
    ((f(middle) < 0) == (low_value < 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Where f is least between `low` and `high`, if it has one minimum there, to about 1e-8 of their distance (rounding
/// lets no search of values see more). Golden section. Calls f(double) -> double.
template <class Function>
double golden_minimum(Function&& f, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  double x1 = high - kGolden * (high - low), x2 = low + kGolden * (high - low);
  double f1 = f(x1), f2 = f(x2);
  for (int step = 0; step < 38; ++step) {
    if (f1 < f2) {
      high = x2, x2 = x1, f2 = f1;
      x1 = high - kGolden * (high - low), f1 = f(x1);
    } else {
      low = x1, x1 = x2, f1 = f2;
      x2 = low + kGolden * (high - low), f2 = f(x2);
    }
  }
  return 0.5 * (low + high);
}

/// HermiteCubic Hermite interpolation of a quantity from values x and rates r at both ends of an interval of length h,
/// at the fraction s of it, and its derivative with respect to time.
struct HermiteCubic {
  double x0, r0, x1, r1, h;

  double value(double s) const {
    const double t = 1 - s;
    return t * t * ((1 + 2 * s) * x0 + s * h * r0) + s * s * ((1 + 2 * t) * x1 - t * h * r1);
  }
  double rate(double s) const {
    const double t = 1 - s;
    return 6 * s * t * (x1 - x0) / h + t * (t - 2 * s) * r0 + s * (s - 2 * t) * r1;
  }
};

/// Coordinates q(t) of a model between two samples: each coordinate by its cubic, quaternions normalized afterwards.
/// With an interval h the error is of order h^4 of a smooth motion.
class MotionSegment {
 public:
  explicit MotionSegment(const Model& model);

  /// From `begin` at t0 to `end` at t1 > t0.
  void set(double t0, const State& begin, double t1, const State& end);
  /// Writes q at the time t; `state` has the model's size, its v are left alone.
  void interpolate(double t, State& state) const;

 private:
  const Model* model_;
  double t0_ = 0;
  std::vector<HermiteCubic> cubics_;
  std::vector<double> rates_begin_, rates_end_;
};

}  // namespace grapnel
