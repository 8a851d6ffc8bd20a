#pragma once

/// @file
/// The largest magnitudes that quantities reach in a motion, found step by step on the integrator's dense output,
/// whatever interval of output there is. Thread safety: one thread at a time.

#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace grapnel {

/// A quantity's value of largest magnitude.
struct Peak {
  double magnitude = -1;  // negative: nothing has been seen
  double time = 0;        // [s]
};

class PeakSearch {
 public:
  /// Writes all quantities at a time.
  using Quantities = std::function<void(double t, std::span<double> values)>;
  struct Point {
    double time = 0;
    std::vector<double> values;
  };

  /// The first `searched` of `all` quantities have their peaks found; the others are evaluated beside them.
  explicit PeakSearch(std::size_t searched = 0, std::size_t all = 0);

  /// Looks at a step from `begin` to `end`, at five points (Lobatto's). Where the polynomial through them promises more
  /// than has been seen, the true maximum is looked for with parabolas through points close to each other. `fresh`: the
  /// quantities at `begin` are not those at the last step's end.
  ///
  /// The polynomial has to be right about where the largest values are, not about how large they are: it errs by some
  /// 1e-3 of what a quantity changes in a step of an eighth-order method, the peak found by some 1e-8 of it.
  void step(double begin, double end, bool fresh, const Quantities& at);

  std::span<const Peak> peaks() const { return peaks_; }
  /// Everything that was evaluated in the last step, in the order of time; the ends of the step among it.
  std::span<const Point> points() const { return {points_.data(), used_}; }

 private:
  const Point& evaluate(double t, const Quantities& at);
  void climb(std::size_t quantity, double t, double begin, double end, const Quantities& at);

  std::size_t all_;
  std::vector<Peak> peaks_;
  std::vector<Point> points_;  // room is kept from step to step
  std::size_t used_ = 0;
};

}  // namespace grapnel
