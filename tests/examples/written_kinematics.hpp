#pragma once

/// @file
/// Where a servicer's links, hands and centre of mass are, multiplied out from what its file says, the recorded pose of
/// the base and the recorded joint values: the tests' own forward kinematics.

#include <map>
#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing {

/// Pose of every body of the robot in W at a sample of the time series. Revolute and fixed joints, parents first.
std::map<std::string, Posed> written_poses(const RobotSetup& robot, const CaptureResult& result, std::size_t sample);

/// Pose of an end-effector in W.
Posed written_hand(const RobotSetup& robot, const std::map<std::string, Posed>& poses, const std::string& end_effector);

/// Centre of mass of the robot in W [m].
Vector3d written_com(const RobotSetup& robot, const std::map<std::string, Posed>& poses);

/// Mass of the robot [kg].
double written_mass(const RobotSetup& robot);

}  // namespace grapnel::testing
