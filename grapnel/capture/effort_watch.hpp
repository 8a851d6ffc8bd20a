#pragma once

/// @file
/// When drives run at the limits of their effort, or motions take more than these allow: between samples, from what
/// PeakSearch has evaluated. Thread safety: one thread at a time.

#include <string>
#include <vector>

#include "grapnel/capture/peak_search.hpp"
#include "grapnel/clearance/clearance_result.hpp"

namespace grapnel {

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
