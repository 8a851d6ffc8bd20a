#pragma once

/// @file
/// What the readers of a scenario's parts share: the tree, the robot, what has been read, the names met, the faults.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/scenario/read_robot.hpp"

namespace grapnel {

/// A scenario while it is read. Parts are read in the order of the members of CaptureProblem; later parts look up what
/// earlier ones have named.
struct Reading {
  Reading(const Node& tree, ReadRobot read_robot, const Meshes& target_meshes, FaultList& list)
      : root(tree), robot(std::move(read_robot)), meshes(target_meshes), faults(list) {}

  const Node& root;
  ReadRobot robot;
  const Meshes& meshes;  // of targets
  FaultList& faults;
  CaptureProblem problem;
  NameTable targets{"target"};
  std::map<std::string, NameTable, std::less<>> points;  // by target
  std::set<std::string, std::less<>> gripped;            // names of the targets that grasps name
};

/// What a name of the scenario refers to; null if there is none.
const EndEffectorSetup* end_effector_named(const Reading& reading, const std::string& name);
const GraspPoint* grasp_point_named(const Reading& reading, const std::string& target, const std::string& point);

}  // namespace grapnel
