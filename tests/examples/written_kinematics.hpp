#pragma once

/// @file
/// The tests' own forward kinematics of links, end-effectors and centre of mass, from the scenario file, the recorded
/// pose of the base and the recorded joint positions.

#include <map>
#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing {

/// Pose of every body of the robot in W at a sample of the time series. Revolute and fixed joints, parents first.
std::map<std::string, Posed> written_poses(const RobotSetup& robot, const CaptureResult& result, std::size_t sample);

/// Pose of an end-effector in W.
Posed written_end_effector(const RobotSetup& robot, const std::map<std::string, Posed>& poses,
                           const std::string& end_effector);

/// Centre of mass of the robot in W [m].
Vector3d written_com(const RobotSetup& robot, const std::map<std::string, Posed>& poses);

/// Mass of the robot [kg].
double written_mass(const RobotSetup& robot);

}  // namespace grapnel::testing
