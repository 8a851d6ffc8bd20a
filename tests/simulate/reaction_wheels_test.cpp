/// Reaction wheels: exact exchange of momentum, maximum rates and torques, gyroscopic coupling, torque distribution.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <memory>

#include "grapnel/simulate/controller.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace reaction_wheels_test {

constexpr double kNone = std::numeric_limits<double>::infinity();

// A body with rotors about body-fixed axes; its inertia includes them.
struct Gyrostat {
  Model model;
  std::vector<ReactionWheel> wheels;
};

Symmetric3d rotor_inertia(const Vector3d& a, double J) {
  const double h = 0.5 * J;
  return {h + h * a[0] * a[0], h + h * a[1] * a[1], h + h * a[2] * a[2],
          h * a[0] * a[1],     h * a[0] * a[2],     h * a[1] * a[2]};
}

Gyrostat gyrostat(Symmetric3d inertia, const std::vector<Vector3d>& axes, double J, double torque = kNone,
                  double rate = kNone, double viscous = 0, double coulomb = 0) {
  BodyDescription base;
  base.name = "base";
  base.joint.name = "base", base.joint.type = JointType::free;
  base.mass = 50;
  ModelBuilder builder;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    BodyDescription rotor;
    rotor.name = "wheel" + std::to_string(i);
    rotor.parent = "base";
    rotor.joint.name = rotor.name, rotor.joint.type = JointType::revolute, rotor.joint.axis = axes[i];
    rotor.joint.friction = {viscous, coulomb, 1e-3};
    rotor.mass = 1e-3;
    rotor.inertia = rotor_inertia(axes[i], J);
    for (double Symmetric3d::*entry :
         {&Symmetric3d::xx, &Symmetric3d::yy, &Symmetric3d::zz, &Symmetric3d::xy, &Symmetric3d::xz, &Symmetric3d::yz})
      inertia.*entry -= rotor.inertia.*entry;
    builder.add(rotor);
  }
  base.inertia = inertia;
  builder.add(base);
  Gyrostat result{builder.build(), {}};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const int body = result.model.body_index("wheel" + std::to_string(i));
    const auto& joints = result.model.joints();
    const auto at = std::find(joints.begin(), joints.end(), body);
    result.wheels.push_back(
        {static_cast<int>(at - joints.begin()), result.model.bodies()[body].v, axes[i], torque, rate});
  }
  return result;
}

const std::vector<Vector3d> kAxes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

std::vector<Vector3d> pyramid() {
  const double c = std::cos(0.6), s = std::sin(0.6);
  return {{c, 0, s}, {0, c, s}, {-c, 0, s}, {0, -c, s}};
}

State spinning(const Gyrostat& g, const Vector3d& w_B) {
  State state = zero_state(g.model);
  const Body& base = g.model.bodies()[g.model.body_index("base")];
  for (int k = 0; k < 3; ++k) state.v[base.v + k] = w_B[k];
  return state;
}

Vector3d rate_of(const Gyrostat& g, const State& state) {
  const Body& base = g.model.bodies()[g.model.body_index("base")];
  return {state.v[base.v], state.v[base.v + 1], state.v[base.v + 2]};
}

// Commands a constant torque on the base.
struct ConstantTorque : Controller {
  explicit ConstantTorque(const Vector3d& t) : torque(t) {}
  void update(const ControlInput&, ControlCommand& command) override { command.base_torque = torque; }
  Vector3d torque;
};

PhaseSetup commanding_torque(const Gyrostat& g, const Vector3d& torque) {
  PhaseSetup setup;
  setup.controller = std::make_shared<ConstantTorque>(torque);
  setup.commanded_root = g.model.body_index("base");
  setup.wheels = g.wheels;
  return setup;
}

// A wheel with the torque u absorbs the spin of a body in the time (J - J_s) w0 / u. Its final rate is J w0 / J_s.
TEST(ReactionWheels, AbsorbSpinInExpectedTime) {
  constexpr double J = 4, J_s = 0.05, w0 = 0.3, u = 0.2;
  const Gyrostat g = gyrostat(Symmetric3d::diagonal(3, 3.5, J), {{0, 0, 1}}, J_s);
  PhaseDynamics dynamics(g.model, commanding_torque(g, {0, 0, -u}));
  EXPECT_FALSE(dynamics.is_disturbed());
  const State start = spinning(g, {0, 0, w0});
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, (J - J_s) * w0 / u, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
        EXPECT_NEAR(rate_of(g, s.state)[2], w0 - u * s.time / (J - J_s), 1e-14);
        EXPECT_LT(norm(totals(g.model, s.state).momentum.angular - Vector3d{0, 0, J * w0}), 1e-12 * J * w0);
        EXPECT_NEAR(s.dynamics->control_torque()[2], -u, 1e-15);
        // The kinetic energy changes by the work of the motor only.
        EXPECT_NEAR(totals(g.model, s.state).energy - totals(g.model, start).energy, s.integrals.motor_work, 1e-12);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_LT(std::abs(rate_of(g, o.end_state)[2]), 1e-14);
  EXPECT_NEAR(o.end_state.v[g.wheels[0].velocity], J * w0 / J_s, 1e-12 * J * w0 / J_s);
}

// Bearing friction dissipates the energy of a free wheel and transfers its momentum to the base: W' m = -(c W + d), m =
// J_s (1 - J_s/J).
TEST(ReactionWheels, BearingFrictionTransfersMomentum) {
  constexpr double J = 4, J_s = 0.05, c = 2e-4, d = 3e-3, W = 40, m = J_s * (1 - J_s / J);
  const Gyrostat g = gyrostat(Symmetric3d::diagonal(3, 3.5, J), {{0, 0, 1}}, J_s, kNone, kNone, c, d);
  PhaseSetup setup;                                 // no drive
  State start = spinning(g, {0, 0, -J_s * W / J});  // zero total momentum
  start.v[g.wheels[0].velocity] = W;
  const double energy = totals(g.model, start).energy;
  double off = 0, heat = 0;
  PhaseDynamics dynamics(g.model, setup);
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 200, 5}, {}, {.observe = [&](const PhaseSample& s) {
        const double now = s.state.v[g.wheels[0].velocity];
        off = std::max(off, std::abs(now - ((W + d / c) * std::exp(-c * s.time / m) - d / c)));
        EXPECT_LT(norm(totals(g.model, s.state).momentum.angular), 1e-12 * J_s * W);
        EXPECT_NEAR(rate_of(g, s.state)[2], -J_s * now / J, 1e-13);
        heat = std::max(heat, std::abs(energy - totals(g.model, s.state).energy + s.integrals.friction_work));
        EXPECT_EQ(s.integrals.motor_work, 0);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] rate %.2g rad/s off, heat %.2g J of %.3g\n", off, heat, -o.integrals.friction_work);
  EXPECT_LT(off, 1e-9);
  EXPECT_LT(heat, 1e-10 * energy);
  EXPECT_GT(-o.integrals.friction_work, 0.5 * energy);
}

// At its maximum rate a wheel provides no more torque: the remaining spin follows from the momentum. A command of the
// opposite sign decelerates it immediately.
TEST(ReactionWheels, SpinRemainsAtMaximumRate) {
  constexpr double J = 4, J_s = 0.05, w0 = 0.3, u = 0.2, most = 20;
  const Gyrostat g = gyrostat(Symmetric3d::diagonal(3, 3.5, J), {{0, 0, 1}}, J_s, kNone, most);
  const auto controller = std::make_shared<ConstantTorque>(Vector3d{0, 0, -u});
  PhaseSetup setup = commanding_torque(g, {});
  setup.controller = controller;
  PhaseDynamics dynamics(g.model, setup);
  double largest = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {spinning(g, {0, 0, w0}), 0, 12, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
        largest = std::max(largest, s.state.v[g.wheels[0].velocity]);
        EXPECT_LT(norm(totals(g.model, s.state).momentum.angular - Vector3d{0, 0, J * w0}), 1e-12 * J * w0);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(largest, most, 1e-11 * most);
  EXPECT_NEAR(o.end_state.v[g.wheels[0].velocity], most, 1e-11 * most);
  EXPECT_NEAR(rate_of(g, o.end_state)[2], (J * w0 - J_s * most) / J, 1e-14);
  EXPECT_NEAR(dynamics.control_torque()[2], 0, 1e-13);

  controller->torque = {0, 0, u};
  PhaseDynamics back(g.model, setup);
  const PhaseOutcome slower = simulate_phase(back, {o.end_state, 0, 1, 0.5});
  ASSERT_TRUE(slower.finished) << slower.failure;
  EXPECT_NEAR(rate_of(g, slower.end_state)[2] - rate_of(g, o.end_state)[2], u / (J - J_s), 1e-13);
}

// A wheel held at its maximum rate is released when attitude control reverses the commanded torque.
TEST(ReactionWheels, FreedWhenTorqueReverses) {
  const Gyrostat g = gyrostat(Symmetric3d::diagonal(3, 3.5, 4), {{0, 0, 1}}, 0.05, kNone, 10);
  PhaseSetup setup;
  setup.attitude = {g.model.body_index("base"), Rotationd::identity(), {0, 0, 0.5}, {0, 0, 0.2}};
  setup.wheels = g.wheels;
  setup.recover_roots = true;
  PhaseDynamics dynamics(g.model, setup);
  int at_limit = 0, below = 0;
  double off = 0;
  const State start = spinning(g, {0, 0, 0.25});
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 60, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
        const double rate = std::abs(s.state.v[g.wheels[0].velocity]);
        EXPECT_LT(rate, 10 * (1 + 1e-11));
        (rate > 10 * (1 - 1e-11) ? at_limit : below) += 1;
        off = std::max(off, norm(totals(g.model, s.state).momentum.angular - totals(g.model, start).momentum.angular));
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(at_limit, 5);
  EXPECT_GT(below, 5);
  EXPECT_LT(off, 1e-12);
}

// The rate of a body with free wheels, by J w' = -w x (J w + sum a h), h = J_s (rate + a.w) constant: an independent
// integration, without bodies, joints or recursions.
TEST(ReactionWheels, GyroscopicCoupling) {
  const Symmetric3d J{3, 4, 5, 0.2, -0.1, 0.3};
  constexpr double J_s = 0.08;
  const std::vector<Vector3d> axes = pyramid();
  const Gyrostat g = gyrostat(J, axes, J_s);
  State start = spinning(g, {0.2, -0.3, 0.25});
  const double rates[] = {40, -25, 60, 10};
  Vector3d stored = Vector3d::zero();  // sum a h
  Symmetric3d rest = J;                // J - sum J_s a a^T
  for (std::size_t i = 0; i < axes.size(); ++i) {
    start.v[g.wheels[i].velocity] = rates[i];
    const Vector3d& a = axes[i];
    stored += J_s * (rates[i] + dot(a, rate_of(g, start))) * a;
    rest.xx -= J_s * a[0] * a[0], rest.yy -= J_s * a[1] * a[1], rest.zz -= J_s * a[2] * a[2];
    rest.xy -= J_s * a[0] * a[1], rest.xz -= J_s * a[0] * a[2], rest.yz -= J_s * a[1] * a[2];
  }
  // (J - sum J_s a a^T) w' = -w x ((J - sum J_s a a^T) w + sum a h)
  Eigen::Matrix3d I;
  I << rest.xx, rest.xy, rest.xz, rest.xy, rest.yy, rest.yz, rest.xz, rest.yz, rest.zz;
  const Eigen::Matrix3d inverse = I.inverse();
  const Eigen::Vector3d h(stored[0], stored[1], stored[2]);
  const auto slope = [&](const Eigen::Vector3d& w) -> Eigen::Vector3d { return inverse * -w.cross(I * w + h); };
  Eigen::Vector3d w(0.2, -0.3, 0.25);
  constexpr int kSteps = 20'000;
  const double T = 8, dt = T / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector3d k1 = slope(w), k2 = slope(w + dt / 2 * k1), k3 = slope(w + dt / 2 * k2),
                          k4 = slope(w + dt * k3);
    w += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  PhaseDynamics dynamics(g.model, PhaseSetup{});
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, T});
  ASSERT_TRUE(o.finished) << o.failure;
  const Vector3d end = rate_of(g, o.end_state);
  const double off = (Eigen::Vector3d(end[0], end[1], end[2]) - w).norm();
  std::printf("[ measured ] rate against Euler's equations of a gyrostat: %.3g rad/s\n", off);
  EXPECT_LT(off, 1e-11);
}

// Four wheels bring a tumbling body to rest at its attitude. If one wheel reaches its maximum rate, the other three
// provide the whole torque.
TEST(ReactionWheels, RedistributeTorqueAtMaximumRate) {
  const Gyrostat g = gyrostat({3, 4, 5, 0.2, -0.1, 0.3}, pyramid(), 0.05, 0.5, 9.5);
  PhaseSetup setup;
  setup.attitude = {g.model.body_index("base"), rotation_about({0, 0.6, 0.8}, 0.4), {1, 1, 1}, {3, 3, 3}};
  setup.wheels = g.wheels;
  PhaseDynamics dynamics(g.model, setup);
  const State start = spinning(g, {0.1, 0.12, 0.08});
  int at_limit = 0;
  double given = 0, off = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 80, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
        const Quaterniond q = quaternion_from(root_pose(g.model, s.state, setup.attitude->root).R);
        const Vector3d commanded = attitude_torque(*setup.attitude, q, rate_of(g, s.state));
        bool held = false, cut = false;
        for (const ReactionWheel& wheel : g.wheels) {
          held = held || std::abs(s.state.v[wheel.velocity]) > 9.5 * (1 - 1e-11);
          cut = cut || std::abs(s.motor[wheel.joint]) > 0.5 * (1 - 1e-9);
          EXPECT_LT(std::abs(s.state.v[wheel.velocity]), 9.5 * (1 + 1e-11));
        }
        at_limit += held;
        // The torque that holds the wheel at its rate is small, and the control law ignores it.
        if (!cut) given = std::max(given, norm(s.dynamics->control_torque() - commanded));
        off = std::max(off, norm(totals(g.model, s.state).momentum.angular - totals(g.model, start).momentum.angular));
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(at_limit, 10);
  std::printf("[ measured ] torque missed %.3g N m, momentum %.3g N m s, rate left %.3g\n", given, off,
              norm(rate_of(g, o.end_state)));
  EXPECT_LT(given, 2e-2);
  EXPECT_LT(off, 1e-12);
  EXPECT_LT(norm(rate_of(g, o.end_state)), 1e-6);
}

// Random wheels with many changes of mode: rates stay within their maxima, momentum and energy are conserved.
TEST(ReactionWheels, StayWithinMaximumRates) {
  Random random(7301);
  double off = 0, lost = 0;
  int held = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<Vector3d> axes;
    const int count = 1 + trial % 5;
    for (int i = 0; i < count; ++i) axes.push_back(random.direction());
    Gyrostat g = gyrostat({3, 4, 5, 0.2, -0.1, 0.3}, axes, 0.05, random.uniform(0.02, 0.5), kNone, trial % 2 * 1e-4);
    State start = spinning(g, 0.3 * random.direction());
    for (ReactionWheel& wheel : g.wheels) {
      wheel.rate = random.uniform(3, 15);
      start.v[wheel.velocity] = wheel.rate * random.uniform(-1, 1);
      if (trial % 7 == 0) start.v[wheel.velocity] = wheel.rate;
    }
    PhaseSetup setup;
    setup.attitude = {g.model.body_index("base"), random.rotation(), {1, 1, 1}, {2, 2, 2}};
    setup.wheels = g.wheels;
    PhaseDynamics dynamics(g.model, setup);
    const Totals before = totals(g.model, start);
    const PhaseOutcome o = simulate_phase(
        dynamics, {start, 0, 30, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
          for (const ReactionWheel& wheel : g.wheels) {
            EXPECT_LT(std::abs(s.state.v[wheel.velocity]), wheel.rate * (1 + 1e-10)) << trial << " at " << s.time;
            held += std::abs(s.state.v[wheel.velocity]) > wheel.rate * (1 - 1e-11);
          }
          const Totals now = totals(g.model, s.state);
          off = std::max(off, norm(now.momentum.angular - before.momentum.angular));
          lost =
              std::max(lost, std::abs(now.energy - before.energy - s.integrals.motor_work - s.integrals.friction_work));
        }});
    EXPECT_TRUE(o.finished) << trial << ": " << o.failure;
  }
  std::printf("[ measured ] %d times at the largest rate, momentum %.3g N m s, energy %.3g J\n", held, off, lost);
  EXPECT_GT(held, 1000);
  EXPECT_LT(off, 1e-12);
  EXPECT_LT(lost, 1e-9);
}

// Saturated motors preserve the direction of the torque.
TEST(ReactionWheels, PreserveDirectionOfExcessiveTorque) {
  const Gyrostat g = gyrostat(Symmetric3d::diagonal(3, 4, 5), pyramid(), 0.05, 0.1);
  WheelArray wheels(g.wheels);
  std::vector<double> effort(g.model.joints().size());
  const Vector3d commanded{0.02, -0.01, 0.03};
  wheels.drive(commanded, effort);
  EXPECT_LT(norm(wheels.torque_of(effort) - commanded), 1e-16);
  wheels.drive(100.0 * commanded, effort);
  const Vector3d given = wheels.torque_of(effort);
  EXPECT_LT(norm(cross(given, commanded)) / (norm(given) * norm(commanded)), 1e-15);
  double largest = 0;
  for (double u : effort) largest = std::max(largest, std::abs(u));
  EXPECT_NEAR(largest, 0.1, 1e-16);
}

TEST(ReactionWheels, ReportInfeasibleTorque) {
  const std::vector<Vector3d> plane{{1, 0, 0}, {0.6, 0.8, 0}};
  EXPECT_LT(lacking_torque(plane, {0, 1, 0}), 1e-15);
  EXPECT_NEAR(lacking_torque(plane, {0, 0, 1}), 1, 1e-15);
  EXPECT_NEAR(lacking_torque({}, {0, 0, 1}), 1, 1e-15);
  EXPECT_THROW(WheelArray({{0, 6, {0, 0, 2}, 1, 1}}), std::invalid_argument);
  EXPECT_THROW(WheelArray({{0, 6, {0, 0, 1}, 0, 1}}), std::invalid_argument);
}

}  // namespace reaction_wheels_test
}  // namespace grapnel::testing
