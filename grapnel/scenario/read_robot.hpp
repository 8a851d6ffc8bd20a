#pragma once

/// @file
/// Robot data from a Node tree.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "grapnel/scenario/reader.hpp"

namespace grapnel {

/// What a scenario needs to know about its robot, as far as faults allow.
struct ReadRobot {
  RobotSetup setup;
  NameTable links{"link"};
  NameTable end_effectors{"end-effector"};
  NameTable joint_names{"joint"};
  std::set<std::string, std::less<>> fixed_joints;
  std::vector<JointDescription> joints;  // moving; in the order of Model::joints() if `order_known`
  std::map<std::string, std::size_t, std::less<>> joint_index;
  bool order_known = false;
  bool types_known = true;  // of all joints

  /// Whether `joints` holds what the user means by the moving joints.
  bool count_known() const { return joint_names.complete() && types_known; }
};

/// `path` is "robot" for an inline robot and empty for a file; `meshes` are those that its geometry names.
ReadRobot read_robot(const Node& node, const std::string& path, const Meshes& meshes, FaultList& faults);

/// Model of the robot as it is described. @throws ModelError
Model build_model(const RobotSetup& setup);

}  // namespace grapnel
