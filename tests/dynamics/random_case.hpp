#pragma once

/// @file
/// Random robots of all kinds with a state and forces, for the identities tested in this folder.

#include <Eigen/Core>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

inline constexpr int kRobots = 400;

struct Case {
  Model model;
  State state;
  Forces forces;
};

/// Robot `index`: alternating fixed roots, spherical joints, additional targets, and few or many bodies.
inline Case random_case(int index) {
  RobotOptions options;
  options.min_bodies = 1;
  options.free_root = index % 4 != 3;
  options.spherical_joints = index % 3 == 1;
  options.targets = index % 5 == 2 ? 2 : 0;
  options.max_bodies = index % 2 == 0 ? 20 : 6;
  Random random(index);
  Model model = random_model(options, random);
  State state = random_state(model, random);
  Forces forces = random_forces(model, state, random);
  return {std::move(model), std::move(state), std::move(forces)};
}

/// A random robot whose joints with one axis also have rotors with stated axes, in half of the cases.
inline Case case_with_rotors(int index) {
  Case c = random_case(index);
  if (index % 4 < 2) return c;
  Random random(300000 + index);
  ModelBuilder builder(c.model);
  for (const Body& body : c.model.bodies()) {
    JointDescription joint = body.description.joint;
    if (body.parent < 0 || !has_one_axis(joint.type) || random.chance(0.3)) continue;
    joint.rotor_axis = random.direction();
    joint.rotor_inertia = random.log_uniform(0.01, 1), joint.gear_ratio = random.uniform(-5, 5);
    builder.attach(body.description.name, body.description.parent, body.description.X_PF, joint);
  }
  c.model = builder.build();
  return c;
}

/// Generalized forces of the external wrenches, sum J^T F: computed by Jacobians, independent of the kernels.
inline Eigen::VectorXd external_forces(const Case& c) {
  const Kinematics kinematics = forward_kinematics(c.model, c.state);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(c.model.velocities());
  Eigen::MatrixXd J(6, c.model.velocities());
  for (const ExternalWrench& e : c.forces.external) {
    point_jacobian(c.model, kinematics, e.body, e.p_WP, J);
    sum += J.transpose() * eigen(e.F_W);
  }
  return sum;
}

inline Eigen::VectorXd bias_of(const Model& model, const State& state, const Vector3d& gravity) {
  Workspace workspace(model);
  std::vector<double> result;
  bias(model, state, gravity, workspace, result);
  return eigen(result);
}
inline Eigen::VectorXd bias_of(const Case& c) { return bias_of(c.model, c.state, c.forces.gravity); }

/// The state after a step along given rates of coordinates and velocities, quaternions normalized.
inline State advance(const Model& model, const State& state, const std::vector<double>& qdot,
                     const std::vector<double>& vdot, double step) {
  State result = state;
  for (std::size_t i = 0; i < qdot.size(); ++i) result.q[i] += step * qdot[i];
  for (std::size_t i = 0; i < vdot.size(); ++i) result.v[i] += step * vdot[i];
  for (int offset : model.quaternions()) Eigen::Map<Eigen::Vector4d>(&result.q[offset]).normalize();
  return result;
}

inline std::vector<double> rates_of(const Model& model, const std::vector<double>& q, const std::vector<double>& v) {
  std::vector<double> qdot(model.coordinates());
  coordinate_rates(model, q, v, qdot);
  return qdot;
}

/// Derivative at zero of a function of one number (scalar or Eigen vector), five-point stencil: error h^4 f'''''/30.
template <class F>
auto derivative(F&& f, double h = 1e-4) {
  using Value = decltype(f(h));
  const Value near = f(h) - f(-h), far = f(2 * h) - f(-2 * h);
  return Value((8 * near - far) / (12 * h));
}

/// Base and `joints` revolute links in a row: a robot whose size does not depend on the seed.
inline Model plain_robot(int joints, JointType root = JointType::free) {
  ModelBuilder builder;
  for (int i = 0; i <= joints; ++i) {
    BodyDescription b;
    b.name = "b" + std::to_string(i), b.joint.name = "j" + std::to_string(i), b.mass = 1 + i;
    b.inertia = Symmetric3d::diagonal(1, 1.2, 0.9), b.com = {0.1, 0, 0.2};
    if (i > 0) b.parent = "b" + std::to_string(i - 1), b.X_PF.p = {1, 0.1, 0};
    b.joint.type = i > 0 ? JointType::revolute : root;
    builder.add(b);
  }
  return builder.build();
}

}  // namespace grapnel::testing
