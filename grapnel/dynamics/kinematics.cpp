#include "grapnel/dynamics/kinematics.hpp"

#include "grapnel/dynamics/modal_chains.hpp"

#include <stdexcept>

namespace grapnel {

Kinematics::Kinematics(const Model& model)
    : X_WB(model.bodies().size()), V_WB(model.bodies().size()), links(model.tree().links.size()) {}

void forward_kinematics(const Model& model, const State& state, Kinematics& kinematics) {
  if (static_cast<int>(state.q.size()) != model.coordinates() ||
      static_cast<int>(state.v.size()) != model.velocities()) {
    throw std::invalid_argument("forward_kinematics: the state has another model's size");
  }
  if (kinematics.X_WB.size() != model.bodies().size()) {
    throw std::invalid_argument("forward_kinematics: the output has another model's size");
  }
  link_motion<double>(model.tree(), state.q, state.v, kinematics.links);
  place_bodies(model, kinematics);
}

namespace {

// Exactly.
bool is_identity(const Posed& X) {
  const Rotationd& R = X.R;
  return R(0, 0) == 1 && R(1, 1) == 1 && R(2, 2) == 1 && R(0, 1) == 0 && R(0, 2) == 0 && R(1, 2) == 0 && X.p[0] == 0 &&
         X.p[1] == 0 && X.p[2] == 0;
}

}  // namespace

void place_bodies(const Model& model, Kinematics& kinematics) {
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const BodyPlacement& at = model.bodies()[i].placement;
    const LinkMotion<double>& link = kinematics.links[at.link];
    if (is_identity(at.X_LB)) {  // most bodies
      kinematics.X_WB[i] = link.X_WL, kinematics.V_WB[i] = link.V_WL;
      continue;
    }
    kinematics.X_WB[i] = link.X_WL * at.X_LB;
    kinematics.V_WB[i] = shift(link.V_WL, link.X_WL.R * at.X_LB.p);
  }
}

Kinematics forward_kinematics(const Model& model, const State& state) {
  Kinematics kinematics(model);
  forward_kinematics(model, state, kinematics);
  return kinematics;
}

Posed frame_pose(const Model& model, const Kinematics& kinematics, int frame) {
  const Frame& f = model.frames().at(frame);
  return kinematics.X_WB[f.body] * f.X_BE;
}

Twistd frame_twist(const Model& model, const Kinematics& kinematics, int frame) {
  const Frame& f = model.frames().at(frame);
  return shift(kinematics.V_WB[f.body], kinematics.X_WB[f.body].R * f.X_BE.p);
}

namespace {

// Writes a column from its angular and linear part.
void write_column(Eigen::Ref<Eigen::MatrixXd> J, int column, const Vector3d& angular, const Vector3d& linear) {
  for (int k = 0; k < 3; ++k) J(k, column) = angular[k], J(3 + k, column) = linear[k];
}

}  // namespace

// Kinematics and point => J of (2.1), 6 x velocities: the columns of the joints between the body and its root.
void point_jacobian(const Model& model, const Kinematics& kinematics, int body, const Vector3d& p_WP,
                    Eigen::Ref<Eigen::MatrixXd> J) {
  if (J.rows() != 6 || J.cols() != model.velocities())
    throw std::invalid_argument("point_jacobian: J must be 6 x velocities");
  J.setZero();
  for (int i = body; i >= 0; i = model.bodies()[i].parent) {
    const Body& b = model.bodies()[i];
    const Posed& X = kinematics.X_WB[i];
    const Vector3d arm = p_WP - X.p;
    each_direction(
        b.description.joint.type, b.v, X.R, X.R * b.description.joint.axis,
        [&](int v, const Vector3d& axis) { write_column(J, v, axis, cross(axis, arm)); },
        [&](int v, const Vector3d& axis) { write_column(J, v, Vector3d::zero(), axis); });
  }
  project_columns(model.tree(), J);
}

Eigen::MatrixXd frame_jacobian(const Model& model, const Kinematics& kinematics, int frame) {
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, kinematics, model.frames().at(frame).body, frame_pose(model, kinematics, frame).p, J);
  return J;
}

// Kinematics and vdot => accelerations of all bodies in W, from parent to child by differentiating the relative motion
// of each joint.
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
    const Vector3d spin = V.angular - V_P.angular;                            // relative to the parent
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
