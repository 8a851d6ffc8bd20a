#pragma once

/// @file
/// Two free bodies before contact, far from the world's origin and with a common velocity, and sums that check any
/// compliant impact.

#include <cmath>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

inline BodyDescription free_body(const std::string& name, double mass, const Symmetric3d& inertia) {
  BodyDescription b;
  b.name = b.joint.name = name;
  b.joint.type = JointType::free;
  b.mass = mass;
  b.inertia = inertia;
  return b;
}

/// Central impact of body 0 on body 1 at `speed`, in a direction that is not a coordinate axis, without rotation.
struct CentralPair {
  static constexpr double m0 = 7, m1 = 4, speed = 0.3, m_eff = m0 * m1 / (m0 + m1);
  Model model;
  State state;
  CompliantContact contact;
};

inline CentralPair central_pair() {
  ModelBuilder builder;
  builder.add(free_body("a", CentralPair::m0, Symmetric3d::diagonal(0.5, 0.5, 0.5)));
  builder.add(free_body("b", CentralPair::m1, Symmetric3d::diagonal(0.3, 0.3, 0.3)));
  CentralPair c{builder.build(), {}, {}};
  const Vector3d n{2.0 / 7, 3.0 / 7, 6.0 / 7}, p{5, -3, 2}, along{0.4, -0.2, 0.7};
  c.state = zero_state(c.model);
  set_root_pose(c.model, 0, {Rotationd::identity(), p + 0.5 * n}, c.state);
  set_root_pose(c.model, 1, {Rotationd::identity(), p - 0.4 * n}, c.state);
  set_root_twist(c.model, 0, {Vector3d::zero(), along - CentralPair::speed * n}, c.state);
  set_root_twist(c.model, 1, {Vector3d::zero(), along}, c.state);
  c.contact.robot_body = 0, c.contact.target_body = 1;
  c.contact.p_WC = p, c.contact.n_W = n;
  c.contact.stiffness = 1e5;
  return c;
}

/// Change of total momentum about the initial centre of mass, relative to the sum of the magnitudes of all bodies.
inline double momentum_error(const Model& model, const State& before, const State& after) {
  const Kinematics k0 = forward_kinematics(model, before), k1 = forward_kinematics(model, after);
  const Vector3d com = center_of_mass(model, k0);
  const Momentumd change = momentum_about(model, k1, com) - momentum_about(model, k0, com);
  double linear = 0, angular = 0;
  for (std::size_t b = 0; b < model.bodies().size(); ++b) {
    const BodyMomentum m = body_momentum(model, k0, static_cast<int>(b));
    linear += norm(m.h.linear), angular += norm(m.h.angular) + norm(cross(m.p_WC - com, m.h.linear));
  }
  return std::max(norm(change.linear) / linear, norm(change.angular) / angular);
}

/// Integral of a history by the trapezoidal rule.
inline Vector3d integral(const std::vector<double>& times, const std::vector<Vector3d>& values) {
  Vector3d sum = Vector3d::zero();
  for (std::size_t i = 1; i < times.size(); ++i) {
    sum += 0.5 * (times[i] - times[i - 1]) * (values[i] + values[i - 1]);
  }
  return sum;
}

/// Velocity of body `robot` relative to body `target` at a contact point, in W.
inline Vector3d relative_velocity(const Model& model, const State& state, int robot, int target, const Vector3d& p_W) {
  const Kinematics k = forward_kinematics(model, state);
  return shift(k.V_WB[robot], p_W - k.X_WB[robot].p).linear - shift(k.V_WB[target], p_W - k.X_WB[target].p).linear;
}

}  // namespace grapnel::testing
