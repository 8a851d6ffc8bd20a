#pragma once

/// @file
/// The largest magnitudes that quantities reach in a motion, and when efforts pass their limits: found step by step on
/// the integrator's dense output, whatever interval of output there is.

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "grapnel/clearance/clearance_result.hpp"

namespace grapnel {

/// A quantity's value of largest magnitude.
struct Peak {
  double magnitude = -1;  // negative: nothing has been seen
  double time = 0;        // [s]
};

/// Finds the largest magnitudes of some quantities, step by step.
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

/// Notes when drives run at the limits of their effort, or motions take more than these allow, from what PeakSearch has
/// evaluated.
class EffortWatch {
 public:
  void begin_phase(std::string name);
  /// An effort (entry `quantity` of the points) with a finite limit on its magnitude. `cut`: the drive saturates there;
  /// else beyond it the limit is violated.
  void watch(std::string joint, std::size_t quantity, double limit, bool cut);
  /// The next step: its points, and the quantities between them, where a limit is crossed. What passes a limit and
  /// comes back between two points goes unseen.
  void step(std::span<const PeakSearch::Point> points, const PeakSearch::Quantities& at);
  /// What there was in the phase, in the order of time; an event that its end cuts short ends there.
  std::vector<LimitEvent> end_phase();

 private:
  struct Monitor {
    LimitKind kind;
    std::string joint;
    std::size_t quantity;
    double sign, limit, threshold;  // of sign times the effort
    int open = -1;                  // event under way
    double beyond(const PeakSearch::Point& p) const { return sign * p.values[quantity] - threshold; }
  };
  void note(Monitor& monitor, double time, double value);

  std::string name_;
  std::vector<Monitor> monitors_;
  std::vector<LimitEvent> events_;
  std::vector<double> values_;  // at a crossing
};

}  // namespace grapnel
