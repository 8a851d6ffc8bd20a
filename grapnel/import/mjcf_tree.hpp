#pragma once

/// @file
/// The bodies of an MJCF model, and which of them are the robot.

#include <optional>
#include <vector>

#include "grapnel/import/mjcf_body.hpp"

namespace grapnel {

struct MjcfTree {
  Mark world_mark;               // of <worldbody>
  std::vector<MjcfBody> bodies;  // parents first, in the order of the file; the world is none of them
};

/// Reads all `<worldbody>` sections.
MjcfTree read_mjcf_tree(const MjcfElement& root, MjcfContext& context);

/// The bodies that are read as the robot.
struct MjcfRobot {
  std::vector<int> bodies;  // parents first
  // Whether the trees hang on the world by joints, which then is a link of its own. Otherwise there is one tree, whose
  // root is the robot's.
  bool hangs_on_world = false;
};

/// The tree below the free joint; of several the one that has joints; without a free joint all trees that have joints.
/// What is left out is a decision, and what leaves the choice open a fault, after which the result is empty.
std::optional<MjcfRobot> choose_mjcf_robot(const MjcfTree& tree, MjcfContext& context);

}  // namespace grapnel
