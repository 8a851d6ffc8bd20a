#pragma once

/// @file
/// The times at which efforts exceed their limits, from the points of PeakSearch. Thread safety: one thread at a time.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "grapnel/contact/clearance_result.hpp"
#include "grapnel/integrate/peak_search.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

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
