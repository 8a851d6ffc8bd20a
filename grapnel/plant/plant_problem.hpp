#pragma once

/// @file
/// A capture as a plant: a scenario in which all actuators of the servicer are commanded externally.

#include <stdexcept>
#include <string>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Thrown for a scenario that cannot be a plant, or a plant that cannot continue; what() is a sentence.
struct PlantError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The problem without its control laws. Joints are under JointControl::controller during the approach and after the
/// impact; attitude control is removed. The external controller commands a torque on the base if `base_torque` or the
/// scenario's control.base_torque is set; otherwise all wheel motors and thruster valves of the robot. A base without
/// actuators also receives torques if the scenario controls it by external torques, or if the robot has no driven
/// joints. Planned trajectories are unchanged and remain the joints' references. The caller sets ControlSetup::source.
/// @throws PlantError if there is no sampled control, another controller is configured, no motion is simulated, a
/// torque is requested on a fixed base, or a fixed robot has no driven joints.
CaptureProblem plant_of(CaptureProblem problem, bool base_torque);

}  // namespace grapnel
