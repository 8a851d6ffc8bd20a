/// Motion of beams as segments on springs: a spin-up that requires geometric stiffening, flapping of a spinning beam,
/// momentum, energy and damper work; and an impact.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace beam_motion_test {

constexpr double kPi = std::numbers::pi;

IntegrationSetup tolerances(double relative, double absolute) {
  IntegrationSetup setup;
  setup.relative_tolerance = relative, setup.absolute_tolerance = absolute;
  return setup;
}

// A joint that follows `angle` exactly, as cubics through samples of angle and rate.
JointDrive driven(const std::function<double(double)>& angle, const std::function<double(double)>& rate, double end,
                  int samples) {
  std::vector<double> times, positions, rates;
  for (int i = 0; i <= samples; ++i) {
    times.push_back(end * i / samples);
    positions.push_back(angle(times.back())), rates.push_back(rate(times.back()));
  }
  JointDrive drive;
  drive.control = JointControl::prescribed;
  drive.trajectory = interpolate_samples(times, positions, rates);
  return drive;
}

PhaseSetup with_first_joint(const Model& model, JointDrive drive) {
  PhaseSetup setup;
  setup.drives.resize(model.joints().size());
  setup.drives[0] = std::move(drive);
  return setup;
}

// Kane, Ryan and Banerjee's spin-up (1987) with Simo and Vu-Quoc's data: L = 10 m, E I = 1.4e4 N m^2, 1.2 kg/m, to 6
// rad/s in 15 s. Tip deflections in the hub's axes, from an independent computation. Geometric stiffening is accurate
// to second order in the segment length, since segments are straight.
TEST(BeamMotion, SurvivesASpinUp) {
  const double a = 7.5 / kPi;
  const auto angle = [a](double t) {
    return t < 15 ? 0.4 * (0.5 * t * t + a * a * (std::cos(t / a) - 1)) : 45 + 6 * (t - 15);
  };
  const auto rate = [a](double t) { return t < 15 ? 0.4 * (t - a * std::sin(t / a)) : 6; };
  // With all degrees of freedom of the segments, and with the three lowest modes, including the foreshortening due to
  // their rotations.
  for (const std::optional<int> modes : {std::optional<int>(), std::optional<int>(3)}) {
    RobotSetup robot = only_base(1, 1, true);
    robot.bodies.push_back(slender_link("beam", "base", JointType::revolute, 10, 1.2, 1.4e4, 8));
    robot.bodies.back().beam->modes = modes;
    const Model model = model_of(robot);
    PhaseDynamics dynamics(model, with_first_joint(model, driven(angle, rate, 18, 900)));
    const BodyDescription& last = model.bodies().back().description;
    const double tip = 10 - forward_kinematics(model, zero_state(model)).X_WB.back().p[0];
    EXPECT_EQ(last.name, "beam:16");
    std::map<double, double> at;
    double largest = 0;
    simulate_phase(dynamics, {zero_state(model), 0, 18, 0.02}, tolerances(1e-8, 1e-8),
                   {.observe = [&](const PhaseSample& s) {
                     const Kinematics k = forward_kinematics(model, s.state);
                     const Vector3d p = k.X_WB.back() * Vector3d{tip, 0, 0};
                     const double q = s.state.q[model.bodies()[1].q];
                     const double w = -std::sin(q) * p[0] + std::cos(q) * p[1];
                     at[std::round(50 * s.time) / 50] = w;
                     if (s.time < 15) largest = std::min(largest, w);
                   }});
    EXPECT_NEAR(largest, -0.57375, 1e-3);
    EXPECT_NEAR(at[5], -0.46844, 1e-3);
    EXPECT_NEAR(at[7.5], -0.55898, 1e-3);
    EXPECT_NEAR(at[10], -0.36267, 1.5e-3);
    for (const auto& [t, w] : at) {
      if (t > 15.1) {
        EXPECT_LT(std::abs(w), 5e-3) << t;
      }
    }
  }
}

// Ritz's method with polynomials for a beam of unit length, mass per length and E I that spins with `spin` about an
// axis `offset` before its root: bending out of the plane of the spin, or in it, where the spin also drives it
// outwards.
double spinning_frequency(double spin, double offset, bool in_plane) {
  constexpr int kTerms = 9;
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(kTerms, kTerms), M = K;
  constexpr int kCells = 2000;
  for (int cell = 0; cell < kCells; ++cell) {
    const double s = (cell + 0.5) / kCells,
                 tension = 0.5 * spin * spin * (std::pow(offset + 1, 2) - std::pow(offset + s, 2));
    for (int i = 0; i < kTerms; ++i) {
      for (int j = 0; j < kTerms; ++j) {
        const int a = i + 2, b = j + 2;
        const double w = std::pow(s, a + b), slopes = a * b * std::pow(s, a + b - 2);
        const double bending = a * (a - 1) * b * (b - 1) * std::pow(s, a + b - 4);
        M(i, j) += w / kCells;
        K(i, j) += (bending + tension * slopes - (in_plane ? spin * spin * w : 0)) / kCells;
      }
    }
  }
  const Cholesky root(M);
  const Eigen::MatrixXd half = lower_solution(root, K);
  const Eigen::MatrixXd scaled = lower_solution(root, Eigen::MatrixXd(half.transpose()));
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues()[0]);
}

// A spinning beam, flapping and lagging, with its root on the axis and off it; with all degrees of freedom, and with
// three modes. Against Ritz's method, which is checked against Wright, Smith, Thresher and Wang (1982): 5.5850 at
// Omega* = 4 without offset, in units of sqrt(E I / rho A L^4); without spin 3.5160.
TEST(BeamMotion, SpinningRaisesTheFrequency) {
  SKIP_UNDER_SANITIZERS();
  EXPECT_NEAR(spinning_frequency(4, 0, false), 5.5850, 1e-4);
  EXPECT_NEAR(spinning_frequency(0, 0, false), 3.5160, 1e-4);
  const double spin = 4;
  struct Case {
    double offset;
    bool in_plane;
    std::optional<int> modes = {};
  };
  for (const Case& c :
       {Case{0, false}, Case{0, true}, Case{1, false}, Case{1, true}, Case{0, false, 3}, Case{1, true, 3}}) {
    const double offset = c.offset;
    const bool in_plane = c.in_plane;
    RobotSetup robot = only_base(1, 1, true);
    BodyDescription link = slender_link("beam", "base", JointType::revolute, 1, 1, 1, 4);
    link.com[0] += offset, link.beam->from[0] += offset, link.beam->to[0] += offset;
    if (!in_plane) link.beam->bending_stiffness_z.reset(), link.beam->bending_stiffness_y = 1;
    link.beam->modes = c.modes;
    robot.bodies.push_back(link);
    const Model model = model_of(robot);
    const ElasticMode first = elastic_modes(model, zero_state(model), velocities_of(model, "beam")).front();
    State start = zero_state(model);
    for (int v = 0; v < model.velocities(); ++v) start.v[v] = 1e-4 * first.shape[v];
    PhaseDynamics dynamics(model, with_first_joint(model, driven([&](double t) { return spin * t; },
                                                                 [&](double) { return spin; }, 12, 2)));
    std::vector<double> times, tips;
    simulate_phase(dynamics, {start, 0, 12, 0.005}, tolerances(1e-10, 1e-13), {.observe = [&](const PhaseSample& s) {
                     const Vector3d p = forward_kinematics(model, s.state).X_WB.back().p;
                     const double q = s.state.q[model.bodies()[1].q];
                     times.push_back(s.time),
                         tips.push_back(in_plane ? -std::sin(q) * p[0] + std::cos(q) * p[1] : p[2]);
                   }});
    // Frequency of the best sine fit over the whole time.
    const auto fit = [&](double w) {
      double ss = 0, cc = 0;
      for (std::size_t i = 0; i < times.size(); ++i) {
        const double window = std::pow(std::sin(kPi * times[i] / 12), 2);
        ss += window * tips[i] * std::sin(w * times[i]), cc += window * tips[i] * std::cos(w * times[i]);
      }
      return ss * ss + cc * cc;
    };
    double best = 0, at = 0;
    for (double w = 2; w < 12; w += 0.002) {
      if (fit(w) > best) best = fit(w), at = w;
    }
    const double exact = spinning_frequency(spin, offset, in_plane);
    EXPECT_NEAR(at, exact, 0.01 * exact) << offset << ' ' << in_plane << ' ' << c.modes.has_value();
  }
}

// Without stiffening the spin-up above diverges. In the linear theory, the first mode of the beam, w = s_1(x) eta, in
// the rotating frame obeys eta'' + (omega^2 - Omega^2) eta = -Omega' p. It has no stiffness for Omega above omega =
// 3.80 rad/s. The stability of the simulation is therefore due to the rotation of inextensible segments.
TEST(BeamMotion, WouldDivergeWithoutStiffening) {
  const double omega = std::pow(1.87510406871, 2) / 100 * std::sqrt(1.4e4 / 1.2), a = 7.5 / kPi;
  const double p = 10 * std::sqrt(12.0) * 0.568826;  // integral of rho A x s_1 over a mode of unit modal mass
  double eta = 0, rate = 0;
  const double h = 1e-3;
  for (double t = 0; t < 18; t += h) {
    const double spin = t < 15 ? 0.4 * (t - a * std::sin(t / a)) : 6,
                 spin_up = t < 15 ? 0.4 * (1 - std::cos(t / a)) : 0;
    rate += h * (-spin_up * p - (omega * omega - spin * spin) * eta);
    eta += h * rate;
  }
  EXPECT_GT(std::abs(eta) * 2 / std::sqrt(12.0), 1e3);  // deflection of the tip, in m, of a beam of 10 m
}

// A free arm of two beams and an elastic gear, in space: momenta to rounding error, energy to the tolerance including
// the damper work.
TEST(BeamMotion, ConservesMomentumAndEnergy) {
  RobotSetup robot = only_base(50, 10);
  BodyDescription first = slender_link("first", "base", JointType::revolute, 2, 2, 40, 2);
  first.joint.rotor_inertia = 1e-4, first.joint.gear_ratio = 100;
  first.joint.elasticity = JointElasticity{200, 0};
  first.X_PF.p = {0.5, 0, 0.2};
  first.beam->bending_stiffness_y = 60, first.beam->torsional_stiffness = 20;
  first.inertia.xx = 0.05;
  first.inertia.yy += 0.05, first.inertia.zz += 0.05;
  BodyDescription second = slender_link("second", "first", JointType::revolute, 1, 2, 30, 2);
  second.X_PF.p = {2, 0, 0};
  second.joint.axis = {0, 1, 0};
  for (const double damping : {0.0, 0.02}) {
    first.beam->damping_ratio = second.beam->damping_ratio = damping;
    robot.bodies.resize(1);
    robot.bodies.insert(robot.bodies.end(), {first, second});
    const Model model = model_of(robot);
    State start = zero_state(model);
    for (int v = 0; v < 6; ++v) start.v[v] = 0.1 * (v - 2);
    for (const int body : model.joints()) start.v[model.bodies()[body].v] = 0.3 * std::sin(1.0 + body);
    PhaseSetup setup;
    setup.recover_roots = false;  // momenta then check the whole dynamics
    PhaseDynamics dynamics(model, setup);
    const auto energy = [&](const State& s) {
      double e = kinetic_energy(model, forward_kinematics(model, s), s);
      for (const int body : model.springs()) e += spring_energy(model, s, body);
      return e;
    };
    const auto momentum = [&](const State& s) {
      return momentum_about(model, forward_kinematics(model, s), Vector3d::zero());
    };
    double lost = 0;
    State end;
    simulate_phase(dynamics, {start, 0, 5, 0.5}, tolerances(1e-12, 1e-13),
                   {.observe = [&](const PhaseSample& s) { end = s.state, lost = -s.integrals.friction_work; }});
    EXPECT_NEAR(energy(end) + lost, energy(start), 1e-10 * energy(start));
    if (damping > 0) {
      EXPECT_GT(lost, 1e-3 * energy(start));
    }
    if (damping == 0) {
      EXPECT_EQ(lost, 0);
    }
    const Momentumd drift = momentum(end) - momentum(start);
    EXPECT_LT(norm(drift.linear) + norm(drift.angular), 1e-9);
  }
}

// Motor and link of a gear with backlash b, free, starting in its middle with the relative rate u. The period is that
// of the spring plus two passages of the backlash, 2 pi / omega + 2 b / u. Energy is conserved.
TEST(GearMotion, CrossesBacklash) {
  RobotSetup robot = only_base(1, 1, true);
  BodyDescription link;
  link.name = "link", link.parent = "base";
  link.joint.name = "joint", link.joint.type = JointType::revolute;
  link.joint.rotor_inertia = 1e-4, link.joint.gear_ratio = 100;
  link.joint.elasticity = JointElasticity{50, 0, 0.02};
  link.mass = 1, link.inertia = Symmetric3d::diagonal(2, 2, 2);
  robot.bodies.push_back(link);
  const Model model = model_of(robot);
  const double u = 0.1, period = 2 * kPi / std::sqrt(50 * (1 / 1.0 + 1 / 2.0)) + 2 * 0.02 / u;
  State start = zero_state(model);
  start.v = {-2.0 / 3 * u, u};
  PhaseDynamics dynamics(model, {});
  std::vector<State> at;
  simulate_phase(dynamics, {start, 0, period, period / 4}, tolerances(1e-10, 1e-12),
                 {.observe = [&](const PhaseSample& s) { at.push_back(s.state); }});
  const State& end = at.back();
  EXPECT_NEAR(end.q[1], 0, 1e-7);
  EXPECT_NEAR(end.v[1], u, 1e-7);
  // At a quarter of the period the spring is at its maximum deflection and stores all energy of the relative motion.
  ASSERT_GE(at.size(), 5u);
  const State& quarter = at[at.size() == 5 ? 1 : at.size() / 4];
  EXPECT_NEAR(quarter.q[1], 0.01 + u / std::sqrt(75), 1e-6);
  EXPECT_NEAR(spring_energy(model, quarter, model.springs().front()), 0.5 * (2.0 / 3) * u * u, 1e-7);
}

// Hertzian contact of a free ball with the tip of a beam: the impulse converges to that of the rigid beam with
// increasing stiffness, and momentum and energy are conserved.
TEST(BeamImpact, ComesToTheRigidOneAsTheBeamStiffens) {
  const auto impulse_of = [](double EI, int segments) {
    RobotSetup robot = only_base(20, 5);
    robot.bodies.push_back(slender_link("beam", "base", JointType::fixed, 1, 4, EI > 0 ? EI : 1, segments));
    if (EI == 0) robot.bodies[1].beam.reset();
    ModelBuilder builder(model_of(robot));
    BodyDescription ball;
    ball.name = "ball", ball.joint.name = "ball", ball.joint.type = JointType::free;
    ball.mass = 2, ball.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
    builder.add(ball);
    const Model model = builder.build();
    State state = zero_state(model);
    const int target = model.body_index("ball");
    set_root_pose(model, target, {Rotationd::identity(), {1, -0.2, 0}}, state);
    set_root_twist(model, target, {Vector3d::zero(), {0, 0.1, 0}}, state);
    CompliantContact contact;
    contact.robot_body = model.body_index(EI == 0 ? "beam" : fmt::format("beam:{}", 2 * segments)),
    contact.target_body = target;
    contact.p_WC = {1, 0, 0}, contact.n_W = {0, 1, 0};
    contact.model = ContactForceModel::hertz, contact.stiffness = 1e6;
    const ImpactSolution outcome = compliant_impact(model, state, {&contact, 1}, {}, {});
    EXPECT_EQ(outcome.status, ImpactSolution::Status::separated) << outcome.message;
    EXPECT_LT(outcome.energy_residual, 1e-9) << EI;
    return outcome.forces[0].impulse.linear[1];
  };
  const double rigid = impulse_of(0, 2);
  const double soft = std::abs(impulse_of(1e2, 2) / rigid - 1), stiff = std::abs(impulse_of(1e7, 2) / rigid - 1);
  EXPECT_GT(soft, 0.1);
  EXPECT_LT(stiff, 2e-3);
  // It also converges with the number of segments.
  const double coarse = impulse_of(1e4, 1), middle = impulse_of(1e4, 2), fine = impulse_of(1e4, 4);
  EXPECT_LT(std::abs(fine - middle), 0.3 * std::abs(middle - coarse));
  EXPECT_NEAR(middle, fine, 5e-3 * fine);
}

}  // namespace beam_motion_test
}  // namespace grapnel::testing
