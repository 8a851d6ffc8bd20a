#include "grapnel/plan/joint_efforts.hpp"

namespace grapnel {

JointEfforts::JointEfforts(FloatingBase& base, const Vector3d& gravity)
    : base_(base), workspace_(base.model()), state_(zero_state(base.model())), vdot_(base.model().velocities(), 0.0) {
  forces_.gravity = gravity;
}

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

}  // namespace grapnel
