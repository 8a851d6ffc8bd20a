#pragma once

/// @file
/// Durations for which actuators of the base are at their limits, by integration steps: wheels, control moment gyros
/// and thrusters. Saturated drives of joints and base control are LimitEvents; write() adds them up. Thread safety: one
/// thread at a time.

#include <string>
#include <vector>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Whether the actuators may give a torque that differs from attitude control's command within its limit: steered
/// gyros, and thrusters.
bool gives_base_torque_otherwise(const PhaseSetup& setup);

class SaturationMonitor {
 public:
  explicit SaturationMonitor(const CaptureProblem& problem);

  /// A motion segment begins; the system lives until it ends.
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics);
  /// Whether the phase has actuators to observe.
  bool looks() const { return looks_; }
  /// `reached`: the system at the end of the step.
  void step(double begin, const PhaseSample& reached);
  /// Whether an actuator of the base was at its limit in the last step.
  bool base_is_saturated() const;
  /// Adds the duration of the phase [s].
  void end_phase(double duration) { simulated_ += duration; }
  /// Adds saturated drives, from the result's limit events, and the warnings. `end`: of the run [s].
  void write(double end, CaptureResult& result) const;

 private:
  struct Item {
    SaturationReport report;
    bool was = false;  // at its limit at the end of the previous step
    bool now = false;
  };
  void note(Item& item, double begin, double end, bool saturated, bool was);
  void step_wheels(double begin, const PhaseSample& reached);
  void step_gyros(double begin, const PhaseSample& reached);
  void step_thrusters(double begin, const PhaseSample& reached);

  const CaptureProblem& problem_;
  const CaptureSystem* system_ = nullptr;
  bool looks_ = false, drives_wheels_ = false, steers_ = false, fires_ = false, commands_base_ = false;
  std::vector<Item> wheel_rates_, wheel_torques_, gimbal_rates_, gimbal_torques_, thrusters_;  // in the robot's order
  std::vector<Item> base_;                                                                     // about x, y, z
  Item gyros_;
  double simulated_ = 0;
};

}  // namespace grapnel
