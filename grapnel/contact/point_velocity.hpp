#pragma once

/// @file
/// Velocities of bodies at points of contact.

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// Velocity of a body at the point p_W, in W [m/s]; zero for body -1, which is fixed in W.
inline Vector3d point_velocity(int body, const Vector3d& p_W, const Kinematics& k) {
  return body < 0 ? Vector3d::zero() : shift(k.V_WB[body], p_W - k.X_WB[body].p).linear;
}

/// Velocity of body b relative to body a at a point of hard contact, in W [m/s].
inline Vector3d relative_velocity(const HardPoint& at, const Kinematics& k) {
  return point_velocity(at.body_b, at.p_WC, k) - point_velocity(at.body_a, at.p_WC, k);
}

}  // namespace grapnel
