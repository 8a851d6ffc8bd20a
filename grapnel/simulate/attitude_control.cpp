#include "grapnel/simulate/attitude_control.hpp"

#include <cmath>

namespace grapnel {
namespace {

// For the shorter rotation, from a quaternion of any norm: smooth in its entries, so that an integrator whose stages
// have quaternions of slightly different norm keeps its order.
double turn_per_sine(double s, double w) {
  const double sign = w < 0 ? -1 : 1, size = std::abs(w);
  return sign * (s < 1e-150 ? 2 / size : 2 * std::atan2(s, size) / s);
}

}  // namespace

Vector3d attitude_torque(const AttitudeControl& control, const Quaterniond& q_WB, const Vector3d& w_B) {
  const control_law::AttitudeLaw<double> law{quaternion_from(control.R_WD), control.kp, control.kd, control.limit};
  return control_law::attitude_torque(law, q_WB, w_B, turn_per_sine);
}

}  // namespace grapnel
