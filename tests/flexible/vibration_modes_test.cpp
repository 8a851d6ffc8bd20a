/// Vibration modes stated in a file: they are reproduced for any directions, momentum and energy are conserved, and
/// impossible modes are rejected.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel::testing {
namespace vibration_modes_test {

using ::testing::HasSubstr;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// A manufacturer's table.
BodyDescription panel_with_modes() {
  BodyDescription panel;
  panel.name = "panel", panel.parent = "base", panel.joint.name = "mount";
  panel.mass = 20, panel.com = {1.5, 0, 0}, panel.inertia = Symmetric3d::diagonal(2, 15.2, 15.9);
  panel.modes = {{0.4, 0.005, {0, 0, 3.5}, {0, -7.63, 0}},
                 {2.3, 0.01, Vector3d::zero(), {1.1, 0, 0}},
                 {2.5, 0.005, {0, 0, 1.94}, {0, -1.22, 0}}};
  return panel;
}

// The same panel with the maximum number of modes in arbitrary directions, which move `part` of it in every direction:
// P P^T = part I. Their total mass exceeds the panel's.
BodyDescription panel_with_modes_of_any_direction(unsigned seed, double part) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  BodyDescription panel = panel_with_modes();
  const RigidBodyInertiad I = RigidBodyInertiad::about_com(panel.mass, panel.com, panel.inertia);
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(6, 6);
  const Vector3d& h = I.first_moment;
  const double cross[3][3] = {{0, -h[2], h[1]}, {h[2], 0, -h[0]}, {-h[1], h[0], 0}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) M(i, j) = I.rotational(i, j), M(i, 3 + j) = M(3 + j, i) = cross[i][j];
    M(3 + i, 3 + i) = I.mass;
  }
  Eigen::MatrixXd any(6, 6);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) any(i, j) = normal(random);
  }
  const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(any).householderQ();
  const Eigen::MatrixXd L = Cholesky(M).matrixL();
  const Eigen::MatrixXd P = std::sqrt(part) * (L * Q);
  panel.modes.clear();
  for (int i = 0; i < 6; ++i)
    panel.modes.push_back({0.3 * (i + 1), 0.002 * i, {P(3, i), P(4, i), P(5, i)}, {P(0, i), P(1, i), P(2, i)}});
  return panel;
}

void expect_modes(const BodyDescription& panel) {
  RobotSetup robot = only_base(200, 50);
  robot.bodies.push_back(panel);
  ASSERT_EQ(modes_fault(panel), "");
  const Model model = model_of(robot);
  const State state = zero_state(model);
  const auto modes = elastic_modes(model, state, velocities_of(model, "base"));
  ASSERT_EQ(modes.size(), panel.modes.size());
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const VibrationMode& given = panel.modes[i];
    EXPECT_NEAR(modes[i].frequency, given.frequency, 1e-11 * given.frequency);
    EXPECT_NEAR(modes[i].damping_ratio, given.damping_ratio, 1e-13);
    const Vector6 p = participation(model, state, modes[i], 0);
    const Vector6 stated{given.rotation[0],    given.rotation[1],    given.rotation[2],
                         given.translation[0], given.translation[1], given.translation[2]};
    EXPECT_LT((p.dot(stated) < 0 ? Vector6(p + stated) : Vector6(p - stated)).norm(), 1e-11 * stated.norm()) << i;
  }
  // The total inertia is the stated one.
  ModelBuilder rigid;
  for (const BodyDescription& body : rigid_robot(robot).bodies) rigid.add(body);
  const RigidBodyInertiad a = total_of(rigid.build()), b = total_of(model);
  EXPECT_NEAR(a.mass, b.mass, 1e-12);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.first_moment[i], b.first_moment[i], 1e-11);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(a.rotational(i, j), b.rotational(i, j), 1e-11);
  }
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(mass_matrix(model, state)).eigenvalues()[0], 0);
}

TEST(VibrationModes, AreReproduced) { expect_modes(panel_with_modes()); }

TEST(VibrationModes, MayHaveAnyDirections) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const BodyDescription panel = panel_with_modes_of_any_direction(seed, 0.9);
    expect_modes(panel);
    double masses = 0;
    for (const VibrationMode& mode : panel.modes) masses += dot(mode.translation, mode.translation);
    EXPECT_GT(masses, 2 * panel.mass);
  }
  // The whole mass, and a torsional mode whose translation is rounding error of a finite-element program.
  expect_modes(panel_with_modes_of_any_direction(7, 1));
  BodyDescription panel = panel_with_modes();
  panel.modes[1].translation = {3e-13, -1e-13, 2e-13};
  const RobotSetup robot = [&] {
    RobotSetup r = only_base(200, 50);
    r.bodies.push_back(panel);
    return flexible_robot(r);
  }();
  for (const BodyDescription& body : robot.bodies) EXPECT_LT(norm(body.X_PF.p), 10) << body.name;
}

// Vibration while the whole body tumbles, as one body and with a soft hinge: momentum to rounding error, energy
// including damper work, and uniform motion of the centre of mass.
TEST(VibrationModes, ConserveMomentumAndEnergy) {
  for (const bool hinged : {false, true}) {
    RobotSetup robot = only_base(60, 8);
    BodyDescription panel = panel_with_modes_of_any_direction(3, 0.8);
    panel.X_PF = {rotation_about({1, 0, 0}, 0.4), {0.5, 0.1, -0.2}};
    if (hinged) {
      panel.joint.type = JointType::continuous, panel.joint.axis = {0, 1, 0};
      panel.joint.spring = JointSpring{30, 0.1, 0.05};
    }
    robot.bodies.push_back(panel);
    const Model model = model_of(robot);
    State start = zero_state(model);
    for (int v = 0; v < 6; ++v) start.v[v] = 0.04 * (v - 2);
    for (const int body : model.springs()) start.q[model.bodies()[body].q] = 0.02 * std::sin(1.0 + body);
    PhaseSetup setup;
    setup.recover_roots = false;  // momenta are then a check on everything
    PhaseDynamics dynamics(model, setup);
    const auto energy = [&](const State& s) {
      double e = kinetic_energy(model, forward_kinematics(model, s), s);
      for (const int body : model.springs()) e += spring_energy(model, s, body);
      return e;
    };
    const auto momentum = [&](const State& s) {
      return momentum_about(model, forward_kinematics(model, s), Vector3d::zero());
    };
    const auto com = [&](const State& s) { return center_of_mass(model, forward_kinematics(model, s)); };
    IntegrationSetup tolerances;
    tolerances.relative_tolerance = 1e-12, tolerances.absolute_tolerance = 1e-13;
    double lost = 0, largest = 0;
    State end;
    simulate_phase(dynamics, {start, 0, 8, 0.5}, tolerances, {.observe = [&](const PhaseSample& s) {
                     end = s.state, lost = -s.integrals.friction_work;
                     for (const int body : model.springs())
                       largest = std::max(largest, std::abs(s.state.q[model.bodies()[body].q]));
                   }});
    EXPECT_GT(largest, 0.02);
    EXPECT_GT(lost, 1e-4 * energy(start));
    EXPECT_NEAR(energy(end) + lost, energy(start), 1e-9 * energy(start));
    const Momentumd before = momentum(start), drift = momentum(end) - before;
    EXPECT_LT(norm(drift.linear) + norm(drift.angular), 1e-9 * (norm(before.linear) + norm(before.angular)));
    EXPECT_LT(norm(com(end) - com(start) - (8 / model.mass()) * before.linear), 1e-9);
  }
}

TEST(VibrationModes, RejectImpossibleModes) {
  const auto fault = [](auto change) {
    BodyDescription panel = panel_with_modes();
    change(panel);
    return modes_fault(panel);
  };
  EXPECT_EQ(fault([](BodyDescription&) {}), "");
  EXPECT_EQ(fault([](BodyDescription& p) { p.modes[0].rotation = {0, -7.63, 0.1}; }), "");  // as a screw
  EXPECT_THAT(fault([](BodyDescription& p) { p.modes[0].translation[2] = 5; }),
              HasSubstr("move 1.45612 times the body's inertia in one direction, mostly moving along z"));
  EXPECT_THAT(fault([](BodyDescription& p) { p.modes[1].rotation[0] = 1.5; }), HasSubstr("mostly turning about x"));
  EXPECT_THAT(fault([](BodyDescription& p) { p.modes[1].rotation[0] = 0; }), HasSubstr("no participation"));
  EXPECT_THAT(fault([](BodyDescription& p) { p.modes[1].frequency = 0; }), HasSubstr("positive frequency"));
  EXPECT_THAT(fault([](BodyDescription& p) { p.beam = BeamDescription{}; }), HasSubstr("both a beam and modes"));
  // On a hinge some mass must remain.
  BodyDescription all = panel_with_modes_of_any_direction(7, 1);
  EXPECT_EQ(modes_fault(all), "");
  all.joint.type = JointType::continuous;
  EXPECT_THAT(modes_fault(all), HasSubstr("part of it must remain"));
}

}  // namespace vibration_modes_test
}  // namespace grapnel::testing
