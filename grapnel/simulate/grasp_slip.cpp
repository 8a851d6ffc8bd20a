#include "grapnel/simulate/grasp_slip.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Relative twist => its norm of (8.16): the largest power of a wrench inside the limits [W].
double power_norm(const GraspSlip& slip, const Twistd& V) {
  return std::hypot(slip.moment * norm(V.angular), slip.force * norm(V.linear));
}

// The power norm of the slip resolution [W].
double resolution(const GraspSlip& slip) { return kSlipResolution * (slip.force > 0 ? slip.force : slip.moment); }

}  // namespace

// Wrench => twist of the size of the resolution, opposite to the normal of the limit surface at this wrench.
Twistd slip_offset(const GraspSlip& slip, const Wrenchd& F_C) {
  Twistd normal = Twistd::zero();
  if (slip.moment > 0) normal.angular = (1 / (slip.moment * slip.moment)) * F_C.angular;
  if (slip.force > 0) normal.linear = (1 / (slip.force * slip.force)) * F_C.linear;
  const double size = power_norm(slip, normal);
  return size > 0 ? (-resolution(slip) / size) * normal : Twistd::zero();
}

// Relative twist at C => wrench on the limit surface, opposite to it; within the resolution proportional to it (8.17).
SlipState slip_state(const GraspSlip& slip, const Kinematics& kinematics) {
  const Posed X_WC = kinematics.X_WB[slip.body_a] * slip.X_AC;
  const Twistd V_WC = shift(kinematics.V_WB[slip.body_a], X_WC.p - kinematics.X_WB[slip.body_a].p) -
                      shift(kinematics.V_WB[slip.body_b], X_WC.p - kinematics.X_WB[slip.body_b].p);
  SlipState state;
  state.p_WC = X_WC.p;
  state.V_C = transposed_times(X_WC.R, V_WC);
  if (!(slip.moment > 0)) state.V_C.angular = Vector3d::zero();
  if (!(slip.force > 0)) state.V_C.linear = Vector3d::zero();
  const Twistd U = state.V_C + slip.offset_C;
  const double scale = resolution(slip), size = power_norm(slip, U);
  state.speed = power_norm(slip, state.V_C) / scale;
  state.driven_speed = size / scale;
  const double factor = -1 / std::max(size, scale);
  const Wrenchd F_C{(factor * slip.moment * slip.moment) * U.angular, (factor * slip.force * slip.force) * U.linear};
  state.F_WC = X_WC.R * F_C;
  state.friction_power = -(dot(F_C.angular, state.V_C.angular) + dot(F_C.linear, state.V_C.linear));
  return state;
}

}  // namespace grapnel
