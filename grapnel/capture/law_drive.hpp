#pragma once

/// @file
/// A law that moves all joints together, during an impact in time: continuously, or at the ticks of the run's clock.

#include <memory>

#include "grapnel/capture/sensor_run.hpp"
#include "grapnel/control/joint_law.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

class LawDrive : public ImpactDrive {
 public:
  /// `begin`: of the impact, on the scenario's clock. `clock`: of sampled control; null: the law speaks continuously.
  /// `sensors`: read at its ticks, as far as they read motion; null: the law knows the truth. `system`, clock and
  /// sensors outlive it.
  LawDrive(std::shared_ptr<JointLaw> law, const CaptureSystem& system, double begin,
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
