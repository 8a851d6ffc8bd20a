#pragma once

/// @file
/// Observes actuators of other kinds (OtherActuators) by their signals: time series, largest values and saturation.
/// Thread safety: one thread at a time.

#include <vector>

#include "grapnel/capture/motion_observer.hpp"

namespace grapnel {

class EffectorMonitor final : public MotionObserver {
 public:
  explicit EffectorMonitor(const CaptureProblem& problem);

  std::vector<Series> series() const override;
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  bool observes() const override { return !uses_.empty(); }
  void step(const PhaseStep& step) override;
  void write(CaptureResult& result) const override { result.actuators = uses_; }

 private:
  std::vector<double> values(const PhaseDynamics* dynamics) const;

  std::vector<ActuatorSignal> signals_;
  std::vector<ActuatorUse> uses_;  // per component with a limit
};

}  // namespace grapnel
