#pragma once

/// @file
/// The surface at which an end-effector that does not grip touches a target. Thread safety: pure functions.

#include <optional>

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Outward unit normal of a target's surface at a grasp point, in the target's frame: the point's own, else against its
/// approach direction, else from the centre of a spherical target through it. Empty if none of these is there.
std::optional<Vector3d> contact_normal(const TargetSetup& target, const GraspPoint& point);

/// The same of a grasp's target where it is now, in W. @throws CaptureProblemError if there is none.
Vector3d contact_normal_in_world(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics, const GraspSetup& grasp);

}  // namespace grapnel
