#pragma once

/// @file
/// A law that moves all joints together, during a compliant impact: continuously, or at the sample times of the run's
/// clock.

#include <memory>

#include "grapnel/capture/sensor_run.hpp"
#include "grapnel/control/joint_law.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

class CoordinatedDrive : public ImpactDrive {
 public:
  /// `begin`: of the impact, on the scenario's clock. `clock`: of sampled control; null: the law acts continuously.
  /// `sensors`: read at its sample times, if they measure motion; null: the law receives true values. `system`, clock
  /// and sensors outlive it.
  CoordinatedDrive(std::shared_ptr<JointLaw> law, const CaptureSystem& system, double begin,
                   std::shared_ptr<ControlClock> clock, SensorRun* sensors = nullptr);

  double next_break(double t) const override;
  void begin_piece(double t, const State& state, std::span<const ExternalWrench> wrenches) override;
  void efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
               std::span<double> effort) override;

 private:
  std::shared_ptr<JointLaw> law_;
  const CaptureSystem& system_;
  double begin_;
  std::shared_ptr<ControlClock> clock_;
  SensorRun* sensors_;
};

}  // namespace grapnel
