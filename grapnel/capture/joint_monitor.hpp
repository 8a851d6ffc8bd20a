#pragma once

/// @file
/// Observes joints with static friction, stops or motor data. Thread safety: one thread at a time.

#include <string>
#include <vector>

#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class JointMonitor {
 public:
  /// The dynamics must live until the phase ends.
  void begin_phase(const std::string& name, const PhaseDynamics& dynamics);
  /// Ends a phase that has finished.
  void end_phase(const PhaseOutcome& outcome);
  void write(CaptureResult& result) const;

 private:
  void write_row(CaptureResult& result) const;

  std::string name_;
  const PhaseDynamics* dynamics_ = nullptr;
  std::vector<JointReport> reports_;
  std::vector<StopImpact> stop_impacts_;
  long stop_impact_count_ = 0;
};

}  // namespace grapnel
