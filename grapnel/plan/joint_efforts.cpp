#include "grapnel/plan/joint_efforts.hpp"

#include <stdexcept>

namespace grapnel {

JointEfforts::JointEfforts(FloatingBase& base, const Vector3d& gravity)
    : base_(base), workspace_(base.model()), state_(zero_state(base.model())), vdot_(base.model().velocities(), 0.0) {
  forces_.gravity = gravity;
}

// Motion of the joints => efforts (1): recursive Newton-Euler with zero base acceleration, corrected by the base's
// reaction wrench.
void JointEfforts::evaluate(std::span<const double> position, std::span<const double> rate,
                            std::span<const double> acceleration, const Posed& X_WB, const Momentumd& h_B,
                            std::span<double> effort) {
  const Model& model = base_.model();
  base_.place(position);
  Vector6d V_B = Vector6d::Zero();
  if (base_.floats()) {
    V_B = base_.momentum_part(h_B);
    for (int j = 0; j < base_.joints(); ++j) V_B += rate[static_cast<std::size_t>(j)] * base_.per_rate().col(j);
  }
  const bool has_free_root = model.bodies()[0].description.joint.type == JointType::free;
  if (has_free_root) set_root_pose(model, 0, X_WB, state_);
  if (has_free_root) {
    for (int k = 0; k < 6; ++k) state_.v[static_cast<std::size_t>(model.bodies()[0].v + k)] = V_B[k];
  }
  for (std::size_t j = 0; j < position.size(); ++j) {
    const Body& body = model.bodies()[model.joints()[j]];
    state_.q[body.q] = position[j], state_.v[body.v] = rate[j], vdot_[body.v] = acceleration[j];
  }
  inverse_dynamics(model, state_, vdot_, forces_, workspace_, tau_);
  Vector6d F_0 = Vector6d::Zero();
  if (base_.floats()) {
    for (int k = 0; k < 6; ++k) F_0[k] = tau_[static_cast<std::size_t>(model.bodies()[0].v + k)];
  }
  for (std::size_t j = 0; j < position.size(); ++j) {
    effort[j] = tau_[model.bodies()[model.joints()[j]].v];
    if (base_.floats()) effort[j] += base_.per_rate().col(static_cast<Eigen::Index>(j)).dot(F_0);  // (1)
  }
}

// Motion of the joints and weights => derivatives of the weighted sum of efforts (2), by reverse differentiation (3),
// (4).
void JointEfforts::differentiate(std::span<const double> position, std::span<const double> rate,
                                 std::span<const double> acceleration, const Posed& X_WB, const Momentumd& h_B,
                                 std::span<const double> weights, Gradient& gradient) {
  const Model& model = base_.model();
  if (!model.rotors().empty())
    throw std::invalid_argument("JointEfforts: derivatives are not available for rotors with stated axes");
  const std::vector<TreeLink<double>>& tree = model.tree().links;
  base_.place(position);
  const PlacedLinks& links = base_.placed();
  base_.move(weights, Momentumd::zero());
  const Vector6d U_0 = base_.base_twist();
  const Matrix6Xd U_per_angle = base_.per_angle();
  base_.move(rate, h_B);  // its derivatives are used at the end

  sweep_.resize(tree.size());
  for (std::size_t i = 0; i < tree.size(); ++i) {
    Sweep& w = sweep_[i];
    const int joint = base_.joint_of_link(static_cast<int>(i));
    if (joint < 0) {
      w.V = twist_from(base_.base_twist()), w.U = twist_from(U_0);
      w.A = SpatialAccelerationd::zero();
      if (!base_.floats()) w.A.linear = -transposed_times(X_WB.R, forces_.gravity);
    } else {
      const auto j = static_cast<std::size_t>(joint);
      const Sweep& p = sweep_[static_cast<std::size_t>(tree[i].parent)];
      const Twistd& S = links.axis[i];
      w.V = p.V + rate[j] * S, w.U = p.U + weights[j] * S;
      w.A = p.A + cross_motion(w.V, rate[j] * S);
      w.A.angular += acceleration[j] * S.angular, w.A.linear += acceleration[j] * S.linear;
    }
    const RigidBodyInertiad& I = links.inertia[i];
    const Momentumd h = I * w.V, of_U = I * w.U;
    w.per_A = {of_U.angular, of_U.linear};
    w.per_U = I * w.A + cross_force(w.V, h);
    w.per_V = I * cross_motion(w.U, w.V) - cross_force(w.U, h);  // (3)
  }

  gradient.position.assign(position.size(), 0.0);
  gradient.rate.assign(position.size(), 0.0), gradient.acceleration.assign(position.size(), 0.0);
  for (std::size_t i = tree.size(); i-- > 0;) {
    Sweep& w = sweep_[i];
    const int joint = base_.joint_of_link(static_cast<int>(i));
    if (joint < 0) continue;
    const auto j = static_cast<std::size_t>(joint);
    Sweep& p = sweep_[static_cast<std::size_t>(tree[i].parent)];
    const Twistd& S = links.axis[i];
    const auto power = [](const Wrenchd& F, const SpatialAccelerationd& A) {
      return dot(F.angular, A.angular) + dot(F.linear, A.linear);
    };
    w.per_V += rate[j] * cross_force(S, Momentumd{w.per_A.angular, w.per_A.linear});
    gradient.acceleration[j] = dot(w.per_A, S) + tree[i].armature * weights[j];
    gradient.rate[j] = dot(w.per_V, S) + power(w.per_A, cross_motion(w.V, S));
    gradient.position[j] = power(w.per_V, cross_motion(p.V, S)) + power(w.per_U, cross_motion(p.U, S)) +
                           power(w.per_A, cross_motion(Twistd{p.A.angular, p.A.linear}, S));  // (4)
    p.per_A += w.per_A, p.per_U += w.per_U, p.per_V += w.per_V;
  }

  for (double& turn : gradient.turn) turn = 0;
  if (!base_.floats()) return;
  const Vector6d per_V = column(sweep_[0].per_V), per_U = column(sweep_[0].per_U);
  for (int j = 0; j < base_.joints(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    gradient.position[i] += per_V.dot(base_.per_angle().col(j)) + per_U.dot(U_per_angle.col(j));
    gradient.rate[i] += per_V.dot(base_.per_rate().col(j));
  }
  const Vector6d per_displacement = base_.twist_per_displacement(h_B).transpose() * per_V;
  const Vector3d turn = X_WB.R * Vector3d{per_displacement[0], per_displacement[1], per_displacement[2]};
  for (int k = 0; k < 3; ++k) gradient.turn[k] = turn[k];
}

}  // namespace grapnel
