#pragma once

/// @file
/// What reaction wheels do in a run: rates, momentum, torque. Thread safety: one thread at a time.

#include <span>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

class WheelMonitor {
 public:
  explicit WheelMonitor(const CaptureProblem& problem);

  /// The system at some time. `motor`: efforts per Model::joints(); empty where nobody worked them out.
  void look(const CaptureSystem& system, const State& state, std::span<const double> motor);
  bool any() const { return !reports_.empty(); }
  /// A phase begins, and begins again: what was looked at in it is forgotten.
  void begin_phase();
  void restart_phase();
  /// Nothing without wheels, or if nothing was looked at.
  void write(CaptureResult& result) const;

 private:
  std::vector<WheelReport> reports_;
  bool any_ = false;
  std::vector<WheelReport> before_;  // the phase
  bool any_before_ = false;
};

}  // namespace grapnel
