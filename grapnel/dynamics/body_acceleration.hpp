#pragma once

/// @file
/// Accelerations of bodies in the world, from parent to child: independent of the kernels, which work in the links' own
/// frames.

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Ordinary accelerations in W.
struct BodyAcceleration {
  Vector3d angular;  // [rad/s^2]
  Vector3d linear;   // of the body frame's origin [m/s^2]
};

/// Of all bodies, for rates of the velocities `vdot` (empty: zero, what velocities alone make).
std::vector<BodyAcceleration> body_accelerations(const Model& model, const Kinematics& kinematics,
                                                 std::span<const double> vdot);

}  // namespace grapnel
