#pragma once

/// @file
/// Joint motion stated piece by piece.

#include <vector>

#include "grapnel/scenario/read_robot.hpp"

namespace grapnel {

/// approach.pieces. Empty where faults leave the motion in doubt.
std::vector<MotionPiece> read_motion_pieces(const Node& list, const ReadRobot& robot, FaultList& faults);

}  // namespace grapnel
