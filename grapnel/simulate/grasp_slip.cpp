#include "grapnel/simulate/grasp_slip.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Limits of a surface of wrenches: the common one of force and moment, or that of one of them; zero: no part of it.
struct LimitSurface {
  double force, moment;

  // Relative twist => its norm of (8.16): the largest power of a wrench inside the limits [W].
  double power_norm(const Twistd& V) const { return std::hypot(moment * norm(V.angular), force * norm(V.linear)); }
  // P_s of (8.17) [W].
  double resolution() const { return kSlipResolution * (force > 0 ? force : moment); }
};

// Calls visit(surface) for each limit surface of a slip.
template <class Visit>
void for_each_surface(const GraspSlip& slip, Visit&& visit) {
  if (!slip.separate) return visit(LimitSurface{slip.force, slip.moment});
  if (slip.force > 0) visit(LimitSurface{slip.force, 0});
  if (slip.moment > 0) visit(LimitSurface{0, slip.moment});
}

// Relative twist in C's axes => its part in the directions that slip.
Twistd slipping_part(const GraspSlip& slip, Twistd V_C) {
  if (!(slip.moment > 0)) V_C.angular = Vector3d::zero();
  if (!(slip.force > 0)) V_C.linear = Vector3d::zero();
  if (slip.model == GraspModel::hinge) V_C.angular -= dot(V_C.angular, slip.hinge_C) * slip.hinge_C;
  return V_C;
}

}  // namespace

// Wrench => per limit surface a twist of the size of the resolution, opposite to the normal of the surface at it.
Twistd slip_offset(const GraspSlip& slip, const Wrenchd& F_C) {
  Twistd offset = Twistd::zero();
  for_each_surface(slip, [&](const LimitSurface& limits) {
    Twistd normal = Twistd::zero();
    if (limits.moment > 0) normal.angular = (1 / (limits.moment * limits.moment)) * F_C.angular;
    if (limits.force > 0) normal.linear = (1 / (limits.force * limits.force)) * F_C.linear;
    const double size = limits.power_norm(normal);
    if (size > 0) offset += (-limits.resolution() / size) * normal;
  });
  return offset;
}

// Relative twist at C => wrench on the limit surfaces, opposite to it; within the resolution proportional to it (8.17).
SlipState slip_state(const GraspSlip& slip, const Kinematics& kinematics) {
  const Posed X_WC = kinematics.X_WB[slip.body_a] * slip.X_AC;
  const Twistd V_WC = shift(kinematics.V_WB[slip.body_a], X_WC.p - kinematics.X_WB[slip.body_a].p) -
                      shift(kinematics.V_WB[slip.body_b], X_WC.p - kinematics.X_WB[slip.body_b].p);
  SlipState state;
  state.p_WC = X_WC.p;
  state.V_C = slipping_part(slip, transposed_times(X_WC.R, V_WC));
  const Twistd U = state.V_C + slip.offset_C;
  Wrenchd F_C = Wrenchd::zero();
  for_each_surface(slip, [&](const LimitSurface& limits) {
    const double scale = limits.resolution(), size = limits.power_norm(U);
    const SlipSpeed speed{limits.power_norm(state.V_C) / scale, size / scale};
    if (limits.force > 0) state.force = speed;
    if (limits.moment > 0) state.moment = speed;
    const double factor = -1 / std::max(size, scale);
    F_C += Wrenchd{(factor * limits.moment * limits.moment) * U.angular,
                   (factor * limits.force * limits.force) * U.linear};
  });
  state.F_WC = X_WC.R * F_C;
  state.friction_power = -(dot(F_C.angular, state.V_C.angular) + dot(F_C.linear, state.V_C.linear));
  return state;
}

HeldPart held_part(GraspModel grasp, SlipParts slipping) {
  if (!slipping.any()) return {true, grasp};
  if (grasp == GraspModel::point || (slipping.force && slipping.moment)) return {};
  if (slipping.moment) return {true, GraspModel::point};
  return {true, grasp == GraspModel::hinge ? GraspModel::axis : GraspModel::orientation};
}

}  // namespace grapnel
