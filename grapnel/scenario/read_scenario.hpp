#pragma once

/// @file
/// A capture problem from a Node tree. Thread safety: a free function.

#include "grapnel/scenario/read_robot.hpp"

namespace grapnel {

/// `robot` may lack everything where its file could not be read; names and joints are then not checked.
CaptureProblem read_scenario(const Node& node, ReadRobot robot, FaultList& faults);

}  // namespace grapnel
