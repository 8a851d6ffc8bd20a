/// Rotors with stated axes, against a model in which each rotor is a separate body: a balanced rotor on a joint in the
/// link that carries it, geared to the joint that it drives.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/dynamics/root_velocity.hpp"

namespace grapnel::testing {
namespace rotor_test {

// A random robot twice: with geared rotors, and with bodies in their place; v_long = G v_short.
struct Twice {
  Model geared, bodies;
  Eigen::MatrixXd G;
  State state, long_state;
};

// A disc about the unit axis a.
Symmetric3d disc(const Vector3d& a, double J) {
  const double h = 0.5 * J;
  return {h + h * a[0] * a[0], h + h * a[1] * a[1], h + h * a[2] * a[2],
          h * a[0] * a[1],     h * a[0] * a[2],     h * a[1] * a[2]};
}

Twice twice(int index) {
  Random random(index);
  RobotOptions options;
  options.least_bodies = 3, options.most_bodies = 9;
  options.rotors = false;
  options.free_root = index % 3 != 2;
  options.spherical_joints = index % 4 == 1;
  const Model plain = random_model(options, random);
  ModelBuilder geared, bodies;
  std::vector<BodyDescription> rotors;
  std::vector<double> ratios;
  std::vector<std::string> driven;
  for (const Body& b : plain.bodies()) {
    if (b.parent < 0 || !has_one_axis(b.description.joint.type) || random.chance(0.3)) continue;
    const double J = random.log_uniform(0.01, 1);
    BodyDescription rotor;
    rotor.name = rotor.joint.name = "rotor of " + b.description.name;
    rotor.parent = b.description.parent;
    rotor.X_PF = {random.rotation(), random.vector(0.5)};
    rotor.joint.type = JointType::revolute, rotor.joint.axis = random.direction();
    rotor.mass = random.log_uniform(0.1, 2), rotor.inertia = disc(rotor.joint.axis, J);
    rotors.push_back(rotor);
    ratios.push_back(random.uniform(-5, 5));
    driven.push_back(b.description.name);
  }
  for (const Body& b : plain.bodies()) {
    BodyDescription d = b.description;
    bodies.add(d);
    // The links of the geared model carry the rotors.
    RigidBodyInertiad I = RigidBodyInertiad::about_com(d.mass, d.com, d.inertia);
    for (std::size_t r = 0; r < rotors.size(); ++r) {
      const BodyDescription& rotor = rotors[r];
      if (rotor.parent == d.name) I += rotor.X_PF * RigidBodyInertiad::about_com(rotor.mass, {0, 0, 0}, rotor.inertia);
      if (driven[r] != d.name) continue;
      d.joint.rotor_inertia = 2 * 0.5 * dot(rotor.joint.axis, rotor.inertia * rotor.joint.axis);
      d.joint.gear_ratio = ratios[r];
      d.joint.rotor_axis = transposed_times(d.X_PF.R, rotor.X_PF.R * rotor.joint.axis);
    }
    d.mass = I.mass, d.com = I.com();
    const Posed back{Rotationd::identity(), -d.com};
    d.inertia = (back * I).rotational;
    geared.add(d);
  }
  for (const BodyDescription& rotor : rotors) bodies.add(rotor);
  Twice t{geared.build(), bodies.build(), {}, {}, {}};
  t.state = random_state(t.geared, random);
  t.long_state = zero_state(t.bodies);
  t.G = Eigen::MatrixXd::Zero(t.bodies.velocities(), t.geared.velocities());
  for (const Body& b : t.geared.bodies()) {
    const Body& same = t.bodies.bodies()[t.bodies.body_index(b.description.name)];
    for (int k = 0; k < coordinate_count(b.description.joint.type); ++k)
      t.long_state.q[same.q + k] = t.state.q[b.q + k];
    for (int k = 0; k < velocity_count(b.description.joint.type); ++k) t.G(same.v + k, b.v + k) = 1;
  }
  for (std::size_t r = 0; r < rotors.size(); ++r) {
    const Body& rotor = t.bodies.bodies()[t.bodies.body_index(rotors[r].name)];
    const Body& joint = t.geared.bodies()[t.geared.body_index(driven[r])];
    t.long_state.q[rotor.q] = ratios[r] * t.state.q[joint.q];
    t.G(rotor.v, joint.v) = ratios[r];
  }
  const Eigen::VectorXd v = t.G * eigen(t.state.v);
  t.long_state.v.assign(v.begin(), v.end());
  return t;
}

double relative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).lpNorm<Eigen::Infinity>() / std::max(1e-300, b.lpNorm<Eigen::Infinity>());
}

TEST(Rotors, EqualGearedBodies) {
  double mass = 0, inverse = 0, momentum = 0, energy = 0, forward = 0, recovered = 0;
  int with_rotors = 0;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Twice t = twice(i);
    if (t.geared.rotors().empty()) continue;
    ++with_rotors;
    const Eigen::MatrixXd M = mass_matrix(t.geared, t.state);
    const Eigen::MatrixXd reduced = t.G.transpose() * mass_matrix(t.bodies, t.long_state) * t.G;
    mass = std::max(mass, relative(M, reduced));

    // Newton and Euler: tau = G^T tau_long(G vdot), since G is constant.
    Random random(1000 + i);
    const std::vector<double> vdot = random.values(t.geared.velocities(), 2);
    Forces forces;
    forces.gravity = random.vector(5);
    const Eigen::VectorXd long_vdot = t.G * eigen(vdot);
    const Eigen::VectorXd tau =
        t.G.transpose() * eigen(inverse_dynamics(t.bodies, t.long_state,
                                                 std::vector<double>(long_vdot.begin(), long_vdot.end()), forces));
    inverse = std::max(inverse, relative(eigen(inverse_dynamics(t.geared, t.state, vdot, forces)), tau));

    // The articulated recursion goes back.
    forces.generalized.assign(tau.begin(), tau.end());
    const Eigen::VectorXd back = M * (eigen(forward_dynamics(t.geared, t.state, forces)) - eigen(vdot));
    forward = std::max(forward, back.lpNorm<Eigen::Infinity>() / tau.lpNorm<Eigen::Infinity>());

    const Kinematics k = forward_kinematics(t.geared, t.state), l = forward_kinematics(t.bodies, t.long_state);
    const Vector3d p{0.3, -0.2, 0.1};
    const Momentumd h = momentum_about(t.geared, k, p), g = momentum_about(t.bodies, l, p);
    momentum = std::max(momentum, norm(h.angular - g.angular) / norm(g.angular));
    momentum = std::max(momentum, norm(h.linear - g.linear) / norm(g.linear));
    const double T = kinetic_energy(t.bodies, l, t.long_state);
    energy = std::max(energy, std::abs(kinetic_energy(t.geared, k, t.state) - T) / T);
    energy = std::max(energy, std::abs(0.5 * eigen(t.state.v).dot(M * eigen(t.state.v)) - T) / T);

    // A free root's velocity from the momentum.
    if (t.geared.bodies()[0].description.joint.type != JointType::free) continue;
    Workspace workspace(t.geared);
    std::vector<RootMomentum<double>> roots(1);
    root_momenta<double>(t.geared.tree(), t.state.q, t.state.v, workspace.kernel, roots);
    State other = t.state;
    for (int c = 0; c < 6; ++c) other.v[t.geared.bodies()[0].v + c] = 9;
    recover_roots<double>(t.geared.tree(), roots, 0.0, workspace.kernel, other.q, other.v);
    recovered = std::max(recovered, (eigen(other.v) - eigen(t.state.v)).lpNorm<Eigen::Infinity>());
  }
  EXPECT_GT(with_rotors, 150);
  EXPECT_LT(mass, 1e-12);
  EXPECT_LT(inverse, 1e-12);
  EXPECT_LT(forward, 1e-12);
  EXPECT_LT(momentum, 1e-12);
  EXPECT_LT(energy, 1e-12);
  EXPECT_LT(recovered, 1e-12);
  std::printf("mass %g inverse %g forward %g momentum %g energy %g recovered %g\n", mass, inverse, forward, momentum,
              energy, recovered);
}

// Joints whose accelerations are given: the forces that they take.
TEST(Rotors, ReactUnderPrescribedMotion) {
  double worst = 0;
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Twice t = twice(i);
    Random random(2000 + i);
    std::vector<std::uint8_t> prescribed(t.geared.velocities(), 0);
    for (int b : t.geared.joints()) prescribed[t.geared.bodies()[b].v] = random.chance(0.5);
    const std::vector<double> given = random.values(t.geared.velocities(), 2),
                              force = random.values(t.geared.velocities(), 3);
    Workspace workspace(t.geared);
    DynamicsInput<double> in;
    in.q = t.state.q, in.v = t.state.v, in.force = force, in.prescribed = prescribed, in.acceleration = given;
    std::vector<double> vdot(given.size()), taken(given.size());
    articulated_body<double>(t.geared.tree(), in, workspace.kernel, vdot, taken);
    const Eigen::VectorXd tau = eigen(inverse_dynamics(t.geared, t.state, vdot));
    worst = std::max(worst, relative(eigen(taken), tau));
    for (std::size_t v = 0; v < vdot.size(); ++v)
      EXPECT_EQ(prescribed[v] ? given[v] : force[v], prescribed[v] ? vdot[v] : taken[v]);
  }
  EXPECT_LT(worst, 1e-11);
  std::printf("prescribed %g\n", worst);
}

}  // namespace rotor_test
}  // namespace grapnel::testing
