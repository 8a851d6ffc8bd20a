#pragma once

/// @file
/// Observes reaction wheels: rates, momentum, torque. Thread safety: one thread at a time.

#include <span>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

class WheelMonitor {
 public:
  explicit WheelMonitor(const CaptureProblem& problem);

  /// Adds a state of the system. `motor`: efforts per Model::joints(); empty if not computed.
  void look(const CaptureSystem& system, const State& state, std::span<const double> motor);
  bool any() const { return !reports_.empty(); }
  /// Begins or restarts a phase: discards its observations.
  void begin_phase();
  void restart_phase();
  /// Writes nothing without wheels or observations.
  void write(CaptureResult& result) const;

 private:
  std::vector<WheelReport> reports_;
  bool any_ = false;
  std::vector<WheelReport> before_;  // without the current phase
  bool any_before_ = false;
};

}  // namespace grapnel
