#include "grapnel/dynamics/state.hpp"

#include <stdexcept>

namespace grapnel {
namespace {

// The requested root; only roots have a pose in the state.
const Body& root_at(const Model& model, int body) {
  const Body& b = model.bodies().at(body);
  if (b.parent >= 0) throw std::invalid_argument("body '" + b.description.name + "' is not a root");
  return b;
}

Quaterniond quaternion_at(const State& state, int q) {
  return {state.q[q], state.q[q + 1], state.q[q + 2], state.q[q + 3]};
}

}  // namespace

State zero_state(const Model& model) {
  State state;
  state.q.assign(model.coordinates(), 0.0);
  state.v.assign(model.velocities(), 0.0);
  for (int offset : model.quaternions()) state.q[offset] = 1;
  return state;
}

Posed root_pose(const Model& model, const State& state, int body) {
  const Body& b = root_at(model, body);
  if (b.description.joint.type == JointType::fixed) return b.description.X_PF;
  return {rotation_matrix(quaternion_at(state, b.q + 3)), {state.q[b.q], state.q[b.q + 1], state.q[b.q + 2]}};
}

void set_root_pose(const Model& model, int body, const Posed& X_WB, State& state) {
  const Body& b = root_at(model, body);
  if (b.description.joint.type == JointType::fixed) {
    throw std::invalid_argument("root '" + b.description.name +
                                "' is fixed to the world: its pose belongs to the model");
  }
  const Quaterniond q = quaternion_from(X_WB.R);
  const double values[7] = {X_WB.p[0], X_WB.p[1], X_WB.p[2], q.w, q.x, q.y, q.z};
  for (int k = 0; k < 7; ++k) state.q[b.q + k] = values[k];
}

Twistd root_twist(const Model& model, const State& state, int body) {
  const Body& b = root_at(model, body);
  if (b.description.joint.type == JointType::fixed) return Twistd::zero();
  const Rotationd R_WB = rotation_matrix(quaternion_at(state, b.q + 3));
  return R_WB * Twistd{{state.v[b.v], state.v[b.v + 1], state.v[b.v + 2]},
                       {state.v[b.v + 3], state.v[b.v + 4], state.v[b.v + 5]}};
}

void set_root_twist(const Model& model, int body, const Twistd& V_WB, State& state) {
  const Body& b = root_at(model, body);
  if (b.description.joint.type == JointType::fixed) {
    throw std::invalid_argument("root '" + b.description.name + "' is fixed to the world: it has no twist");
  }
  const Twistd V_B = transposed_times(rotation_matrix(quaternion_at(state, b.q + 3)), V_WB);
  for (int k = 0; k < 3; ++k) state.v[b.v + k] = V_B.angular[k], state.v[b.v + 3 + k] = V_B.linear[k];
}

void move_roots_to_origin(const Model& model, State& state) {
  for (const Body& body : model.bodies()) {
    if (body.parent >= 0 || body.description.joint.type != JointType::free) continue;
    for (int k = 0; k < 3; ++k) state.q[body.q + k] = 0;
  }
}

}  // namespace grapnel
