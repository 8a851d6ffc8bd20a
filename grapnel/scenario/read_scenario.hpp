#pragma once

/// @file
/// A capture problem from a Node tree.

#include "grapnel/scenario/read_robot.hpp"
#include "grapnel/scenario/read_trajectory.hpp"

namespace grapnel {

/// `robot` may lack everything where its file could not be read; names and joints are then not checked.
/// `trajectory` is the file that approach.trajectory names, null if there is none or it could not be read.
/// `meshes` are those that targets' geometry names.
CaptureProblem read_scenario(const Node& node, ReadRobot robot, const TrajectoryFile* trajectory, const Meshes& meshes,
                             FaultList& faults);

}  // namespace grapnel
