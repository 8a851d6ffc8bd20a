#pragma once

/// @file
/// A base under attitude control: a torque on a free root by a given law.

#include <limits>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// tau_B = -(kp o phi + kd o w_B), each axis cut at its limit; phi is the rotation vector of R_DB = R_WD^T R_WB in B
/// (angle at most pi), w_B the base's angular velocity in B, both by axis. Reaction wheels and thrusters are not
/// modelled: the torque comes from outside and enters the conservation checks as such.
struct AttitudeControl {
  int root = -1;                           // body index of the free root
  Rotationd R_WD = Rotationd::identity();  // desired attitude
  Vector3d kp = Vector3d::zero();          // [N m/rad]
  Vector3d kd = Vector3d::zero();          // [N m s/rad]
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  Vector3d limit{kNone, kNone, kNone};  // [N m]
};

/// tau_B [N m] for the attitude q_WB (its norm does not matter) and the angular velocity w_B [rad/s].
Vector3d attitude_torque(const AttitudeControl& control, const Quaterniond& q_WB, const Vector3d& w_B);

}  // namespace grapnel
