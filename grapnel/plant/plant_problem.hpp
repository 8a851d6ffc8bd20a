#pragma once

/// @file
/// A capture as a plant: what a scenario describes, with every actuator of the servicer told from outside.

#include <stdexcept>
#include <string>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// A scenario that cannot be a plant, or a plant that cannot go on; what() is a sentence.
struct PlantError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The problem with its laws taken out: joints are under JointControl::controller in the approach and after the impact,
/// attitude control is gone, and the base is turned by what the controller says: a torque on it where `base_torque` or
/// the scenario's control.base_torque say so, else every wheel's motor and every thruster's valve, where the robot has
/// any. A base without actuators takes torques too where the scenario controls it by torques from outside, and where
/// the robot has no driven joints. What is planned stays planned, and is what the joints are to follow.
/// ControlSetup::source is the caller's to set. @throws PlantError if there is no sampled control, the controller is
/// another's, nothing of the robot moves, a torque is to act on a base that is fixed, or a fixed robot has no driven
/// joints.
CaptureProblem plant_of(CaptureProblem problem, bool base_torque);

}  // namespace grapnel
