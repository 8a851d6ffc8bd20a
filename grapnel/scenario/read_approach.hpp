#pragma once

/// @file
/// The approach from a scenario's tree.

#include "grapnel/scenario/read_trajectory.hpp"
#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// Writes problem.approach and, with a trajectory, what the initial joint values and rates lack. Reads the robot, the
/// initial joint values, targets and grasps. `file` is the content of approach.trajectory, null if there is none or it
/// cannot be read.
void read_approach(const Node& node, const TrajectoryFile* file, Reading& reading);

}  // namespace grapnel
