#pragma once

/// @file
/// Motion between two samples of a state. Inside this module only.

#include <vector>

#include "grapnel/dynamics/state.hpp"

namespace grapnel {

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
