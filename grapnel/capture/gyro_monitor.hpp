#pragma once

/// @file
/// What control moment gyros do in a run: angles, rates, torques, and where the array comes near a singularity. Thread
/// safety: one thread at a time.

#include <span>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class GyroMonitor {
 public:
  /// The problem must outlive this.
  explicit GyroMonitor(const CaptureProblem& problem);

  /// A piece of motion begins.
  void begin_phase(const PhaseDynamics& dynamics);
  /// Whether steps are to be looked into: gyros are steered.
  bool looks() const { return steered_; }
  void step(const PhaseStep& step);
  /// The system at some time. `motor`: efforts per Model::joints(); empty where nobody worked them out.
  void look(const CaptureSystem& system, const State& state, std::span<const double> motor);
  /// m (GyroArray) of the array as it is in a state.
  double singularity_measure(const CaptureSystem& system, const State& state) const;
  /// Nothing without gyros, or if nothing was looked at. Warns of hazards.
  void write(CaptureResult& result) const;

 private:
  const CaptureProblem& problem_;
  GyrosReport report_;
  bool steered_ = false;
  bool any_ = false;
};

}  // namespace grapnel
