#include "grapnel/dynamics/momentum.hpp"

#include <algorithm>

namespace grapnel {
namespace {

bool counts(const Model& model, std::span<const int> roots, std::size_t body) {
  return roots.empty() || std::find(roots.begin(), roots.end(), model.bodies()[body].root) != roots.end();
}

}  // namespace

RigidBodyInertiad world_inertia(const Model& model, const Kinematics& kinematics, int body) {
  const BodyDescription& d = model.bodies()[body].description;
  const Posed R_only{kinematics.X_WB[body].R, Vector3d::zero()};
  return R_only * RigidBodyInertiad::about_com(d.mass, d.com, d.inertia);
}

double joint_rate(const Model& model, const Kinematics& kinematics, int body) {
  const Body& b = model.bodies()[body];
  const Posed &X_WP = kinematics.X_WB[b.parent], &X_WB = kinematics.X_WB[body];
  const Vector3d axis_W = X_WP.R * (b.description.X_PF.R * b.description.joint.axis);
  const Twistd relative = kinematics.V_WB[body] - shift(kinematics.V_WB[b.parent], X_WB.p - X_WP.p);
  return dot(axis_W, turns_about_axis(b.description.joint.type) ? relative.angular : relative.linear);
}

Vector3d rotor_momentum(const Model& model, const Kinematics& kinematics, int body) {
  const Body& b = model.bodies()[body];
  return kinematics.X_WB[b.parent].R * (b.description.X_PF.R * b.description.joint.rotor_momentum());
}

// Body => its momentum [angular about its centre of mass; linear] and centre of mass in W, including the spins of the
// rotors that it carries (19.6).
BodyMomentum body_momentum(const Model& model, const Kinematics& kinematics, int body) {
  const BodyDescription& d = model.bodies()[body].description;
  const Posed& X_WB = kinematics.X_WB[body];
  const Vector3d c = X_WB.R * d.com;
  const Twistd V_WC = shift(kinematics.V_WB[body], c);
  const Vector3d w_B = transposed_times(X_WB.R, V_WC.angular);
  BodyMomentum m{{X_WB.R * (d.inertia * w_B), d.mass * V_WC.linear}, X_WB.p + c};
  for (int carried : model.rotors()) {
    if (model.bodies()[carried].parent != body) continue;
    m.h.angular += joint_rate(model, kinematics, carried) * rotor_momentum(model, kinematics, carried);
  }
  return m;
}

Vector3d center_of_mass(const Model& model, const Kinematics& kinematics, std::span<const int> roots) {
  double mass = 0;
  Vector3d first_moment = Vector3d::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (!counts(model, roots, i)) continue;
    const BodyDescription& d = model.bodies()[i].description;
    mass += d.mass;
    first_moment += d.mass * (kinematics.X_WB[i] * d.com);
  }
  return (1 / mass) * first_moment;
}

Momentumd momentum_about(const Model& model, const Kinematics& kinematics, const Vector3d& p_W,
                         std::span<const int> roots) {
  Momentumd total = Momentumd::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (!counts(model, roots, i)) continue;
    const BodyMomentum m = body_momentum(model, kinematics, static_cast<int>(i));
    total += shift(m.h, p_W - m.p_WC);
  }
  return total;
}

// State => kinetic energy of the trees with these roots [J], summed over bodies, with reflected inertias and the
// coupling of rotors with specified axes (19.6).
double kinetic_energy(const Model& model, const Kinematics& kinematics, const State& state,
                      std::span<const int> roots) {
  double twice = 0;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    if (!counts(model, roots, i)) continue;
    const Body& body = model.bodies()[i];
    const BodyDescription& d = body.description;
    const Posed& X_WB = kinematics.X_WB[i];
    const Twistd V_WC = shift(kinematics.V_WB[i], X_WB.R * d.com);
    const Vector3d w_B = transposed_times(X_WB.R, V_WC.angular);
    twice += dot(w_B, d.inertia * w_B) + d.mass * dot(V_WC.linear, V_WC.linear);
    if (has_one_axis(d.joint.type)) {
      const double rate = state.v[body.v];
      twice += d.joint.reflected_inertia() * rate * rate;
    }
  }
  for (int carried : model.rotors()) {
    const Body& body = model.bodies()[carried];
    if (!counts(model, roots, carried)) continue;
    twice +=
        2 * state.v[body.v] * dot(rotor_momentum(model, kinematics, carried), kinematics.V_WB[body.parent].angular);
  }
  return twice / 2;
}

double spring_energy(const Model& model, const State& state, int body) {
  const Body& b = model.bodies()[body];
  return b.description.joint.spring->energy(state.q[b.q]);
}

}  // namespace grapnel
