#pragma once

/// @file
/// The maximum magnitudes of quantities during a motion, and the times at which efforts exceed their limits, found step
/// by step on the integrator's dense output, independent of the output interval. Thread safety: one thread at a time.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/contact/clearance_result.hpp"
#include "grapnel/result/capture_result.hpp"

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

/// Records intervals in which drives are at their effort limits, or motions need more, from the points of PeakSearch.
class EffortWatch {
 public:
  void begin_phase(std::string name);
  /// Adds an effort (entry `quantity` of the points) with a finite limit on its magnitude. `cut`: the drive saturates
  /// at the limit; otherwise exceeding it is a violation.
  void watch(std::string joint, std::size_t quantity, double limit, bool cut);
  /// Adds the next step: its points, and the quantities between them, for crossing times. A limit exceeded only between
  /// two points is not detected.
  void step(std::span<const PeakSearch::Point> points, const PeakSearch::Quantities& at);
  /// The events of the phase, in the order of time; an event in progress ends with the phase.
  std::vector<LimitEvent> end_phase();

 private:
  struct Monitor {
    LimitKind kind;
    std::string joint;
    std::size_t quantity;
    double sign, limit, threshold;  // of sign times the effort
    int open = -1;                  // event in progress
    double beyond(const PeakSearch::Point& p) const { return sign * p.values[quantity] - threshold; }
  };
  void note(Monitor& monitor, double time, double value);

  std::string name_;
  std::vector<Monitor> monitors_;
  std::vector<LimitEvent> events_;
  std::vector<double> values_;  // at a limit crossing
};

}  // namespace grapnel
