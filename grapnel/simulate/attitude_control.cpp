#include "grapnel/simulate/attitude_control.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Rotation vector of the shorter way, from a quaternion of any norm: smooth in its entries, so that an integrator's
// stages, whose quaternions are not quite of unit norm, keep their order.
Vector3d shorter_rotation_vector(const Quaterniond& q) {
  const double sign = q.w < 0 ? -1 : 1;
  const Vector3d v{sign * q.x, sign * q.y, sign * q.z};
  const double s = norm(v), w = std::abs(q.w);
  if (s < 1e-150) return (2 / w) * v;
  return (2 * std::atan2(s, w) / s) * v;
}

}  // namespace

Vector3d attitude_torque(const AttitudeControl& control, const Quaterniond& q_WB, const Vector3d& w_B) {
  const Quaterniond q_WD = quaternion_from(control.R_WD);
  const Vector3d phi = shorter_rotation_vector(Quaterniond{q_WD.w, -q_WD.x, -q_WD.y, -q_WD.z} * q_WB);
  Vector3d torque;
  for (int k = 0; k < 3; ++k) {
    torque[k] = std::clamp(-(control.kp[k] * phi[k] + control.kd[k] * w_B[k]), -control.limit[k], control.limit[k]);
  }
  return torque;
}

}  // namespace grapnel
