#pragma once

/// @file
/// Attitude control of a base: a torque on a free root by a given law.

#include <limits>

#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// tau_B = -(kp o phi + kd o w_B), limited per axis; phi is the rotation vector of R_DB = R_WD^T R_WB in B (angle at
/// most pi), w_B the base's angular velocity in B, both by axis. The torque is external, and enters the conservation
/// checks as such, or is given by PhaseSetup::wheels.
struct AttitudeControl {
  int root = -1;                           // body index of the free root
  Rotationd R_WD = Rotationd::identity();  // desired attitude
  Vector3d kp = Vector3d::zero();          // [N m/rad]
  Vector3d kd = Vector3d::zero();          // [N m s/rad]
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  Vector3d limit{kNone, kNone, kNone};  // [N m]
};

/// tau_B [N m] for the attitude q_WB (of any norm) and the angular velocity w_B [rad/s].
Vector3d attitude_torque(const AttitudeControl& control, const Quaterniond& q_WB, const Vector3d& w_B);

namespace control_law {

/// The law's parameters.
template <class S>
struct AttitudeLaw {
  Quaternion<S> q_WD;
  Vector3<S> kp, kd, limit;
};

/// The law as a template for a single capture (double) and for many in SIMD lanes (packs). `turn_per_sine(s, w)`
/// returns the shorter rotation's angle divided by s, for the norm s of a quaternion's vector part and its scalar part
/// w, with the sign of w: 2 atan2(s, |w|) / s.
template <class S, class TurnPerSine>
GRAPNEL_INLINE Vector3<S> attitude_torque(const AttitudeLaw<S>& law, const Quaternion<S>& q_WB, const Vector3<S>& w_B,
                                          TurnPerSine&& turn_per_sine) {
  const Quaternion<S> q = Quaternion<S>{law.q_WD.w, -law.q_WD.x, -law.q_WD.y, -law.q_WD.z} * q_WB;
  const Vector3<S> v{q.x, q.y, q.z};
  const Vector3<S> phi = turn_per_sine(norm(v), q.w) * v;
  Vector3<S> torque;
  for (int k = 0; k < 3; ++k) torque[k] = within_limit(S(-S(law.kp[k] * phi[k] + law.kd[k] * w_B[k])), law.limit[k]);
  return torque;
}

}  // namespace control_law

}  // namespace grapnel
