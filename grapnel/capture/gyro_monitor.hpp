#pragma once

/// @file
/// Observes control moment gyros: angles, rates, torques, and intervals near singularities of the array. Thread safety:
/// one thread at a time.

#include <span>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class GyroMonitor {
 public:
  /// The problem must outlive this.
  explicit GyroMonitor(const CaptureProblem& problem);

  /// A motion segment begins.
  void begin_phase(const PhaseDynamics& dynamics);
  /// Whether steps must be evaluated: gyros are steered.
  bool looks() const { return steered_; }
  void step(const PhaseStep& step);
  /// Adds a state of the system. `motor`: efforts per Model::joints(); empty if not computed.
  void look(const CaptureSystem& system, const State& state, std::span<const double> motor);
  /// The singularity measure m (GyroArray) of the array in a state.
  double singularity_measure(const CaptureSystem& system, const State& state) const;
  /// Writes nothing without gyros or samples. Warns of intervals near singularities.
  void write(CaptureResult& result) const;

 private:
  const CaptureProblem& problem_;
  GyrosReport report_;
  bool steered_ = false;
  bool any_ = false;
};

}  // namespace grapnel
