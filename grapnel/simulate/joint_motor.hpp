#pragma once

/// @file
/// Models of joint motors: maximum effort at a rate, torque ripple, current. docs/theory, (19.12) to (19.14).

#include <algorithm>
#include <cmath>

#include "grapnel/model/description.hpp"
#include "grapnel/simulate/joint_control.hpp"

namespace grapnel::joint_motor {

/// Limits an effort to the motor's range at a rate: in the direction of motion on the line from limits.effort at rest
/// to zero at the no-load rate, against it limits.effort. A NaN is preserved.
inline double within_line(const JointDescription& joint, double effort, double rate) {
  const double most = joint.limits.effort;
  if (!joint.motor || !std::isfinite(joint.motor->no_load_rate)) return control_law::within_limit(effort, most);
  const double x = rate / joint.motor->no_load_rate;
  const double up = most * std::clamp(1 - x, 0.0, 1.0), down = -most * std::clamp(1 + x, 0.0, 1.0);
  return control_law::min(up, control_law::max(down, effort));
}

/// The effort at the joint, with the ripple at its position.
inline double with_ripple(const JointDescription& joint, double effort, double position) {
  if (!joint.motor || !joint.motor->ripple) return effort;
  const TorqueRipple& r = *joint.motor->ripple;
  return effort * (1 + r.amplitude * std::sin(r.per_turn * joint.gear_ratio * position + r.phase));
}

/// Heat in the winding under an effort without ripple [W]; zero if the torque constant is unknown.
inline double copper_power(const JointDescription& joint, double effort) {
  if (!joint.motor || !(joint.motor->torque_constant > 0)) return 0;
  const double current = effort / (joint.gear_ratio * joint.motor->torque_constant);
  return joint.motor->resistance * current * current;
}

}  // namespace grapnel::joint_motor
