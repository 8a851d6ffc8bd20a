#include "grapnel/dynamics/body_acceleration.hpp"

namespace grapnel {

std::vector<BodyAcceleration> body_accelerations(const Model& model, const Kinematics& k,
                                                 std::span<const double> vdot) {
  const auto rate = [&](int v) { return vdot.empty() ? 0.0 : vdot[v]; };
  const auto rates = [&](int v) { return Vector3d{rate(v), rate(v + 1), rate(v + 2)}; };
  std::vector<BodyAcceleration> result(model.bodies().size());
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    const JointDescription& joint = body.description.joint;
    const Posed& X_WB = k.X_WB[i];
    const Twistd& V = k.V_WB[i];
    if (body.parent < 0) {
      result[i] = {Vector3d::zero(), Vector3d::zero()};
      // Velocities of a free root are components in B: d(R x)/dt = R xdot + w x (R x).
      if (joint.type == JointType::free)
        result[i] = {X_WB.R * rates(body.v), X_WB.R * rates(body.v + 3) + cross(V.angular, V.linear)};
      continue;
    }
    const BodyAcceleration& carrier = result[body.parent];
    const Twistd& V_P = k.V_WB[body.parent];
    const Vector3d arm = X_WB.p - k.X_WB[body.parent].p;
    const Vector3d spin = V.angular - V_P.angular;                            // against the parent
    const Vector3d slip = V.linear - (V_P.linear + cross(V_P.angular, arm));  // of the origin, likewise
    BodyAcceleration& a = result[i];
    a.angular = carrier.angular + cross(V_P.angular, spin);
    a.linear = carrier.linear + cross(carrier.angular, arm) + cross(V_P.angular, cross(V_P.angular, arm)) +
               2.0 * cross(V_P.angular, slip);
    if (traits_of(joint.type).quaternion >= 0) a.angular += X_WB.R * rates(body.v);
    if (has_one_axis(joint.type))
      (turns_about_axis(joint.type) ? a.angular : a.linear) += rate(body.v) * (X_WB.R * joint.axis);
  }
  return result;
}

}  // namespace grapnel
