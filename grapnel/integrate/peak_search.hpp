#pragma once

/// @file
/// The maximum magnitudes of quantities during a motion, found step by step on the integrator's dense output,
/// independent of the output interval. Thread safety: one thread at a time.

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace grapnel {

/// The value of maximum magnitude of a quantity.
struct Peak {
  double magnitude = -1;  // negative: no value yet
  double time = 0;        // [s]
};

/// Finds the maximum magnitudes of quantities, step by step.
class PeakSearch {
 public:
  /// Writes all quantities at a time.
  using Quantities = std::function<void(double t, std::span<double> values)>;
  struct Point {
    double time = 0;
    std::vector<double> values;
  };

  /// Peaks are searched for the first `searched` of `all` quantities; the others are evaluated together with them.
  explicit PeakSearch(std::size_t searched = 0, std::size_t all = 0);

  /// Evaluates a step from `begin` to `end` at five points (Lobatto nodes). If the interpolating polynomial exceeds the
  /// maximum so far, the true maximum is searched by parabolic interpolation through close points. `fresh`: the
  /// quantities at `begin` differ from those at the last step's end.
  ///
  /// The polynomial must locate the maximum, not give its value: its error is about 1e-3 of the change of a quantity in
  /// a step of an eighth-order method; that of the peak is about 1e-8 of it.
  void step(double begin, double end, bool fresh, const Quantities& at);

  std::span<const Peak> peaks() const { return peaks_; }
  /// All points evaluated in the last step, in the order of time, including the ends of the step.
  std::span<const Point> points() const { return {points_.data(), used_}; }

 private:
  const Point& evaluate(double t, const Quantities& at);
  void climb(std::size_t quantity, double t, double begin, double end, const Quantities& at);

  std::size_t all_;
  std::vector<Peak> peaks_;
  std::vector<Point> points_;  // storage is reused between steps
  std::size_t used_ = 0;
};

}  // namespace grapnel
