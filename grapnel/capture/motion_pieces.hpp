#pragma once

/// @file
/// Joint motion stated piece by piece, to and from trajectories. Thread safety: pure functions.

#include <span>

#include "grapnel/capture/capture_problem.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// The motion of one joint.
JointTrajectory trajectory_of(std::span<const MotionPiece> pieces, std::size_t joint);

/// What states these trajectories, which begin at 0 and whose pieces end at the same times. Series stay what they are,
/// polynomial profiles become series of degree 5, cycloidal ones their interpolants, which differ by rounding alone.
/// @throws std::invalid_argument if the pieces' ends differ.
std::vector<MotionPiece> motion_pieces(std::span<const JointTrajectory> joints);

}  // namespace grapnel
