/// Joints with sticking friction and with stops: exact solutions, coupled joints, series of impacts, conservation.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace joint_modes_test {

JointFriction sticking(double coulomb, std::optional<double> breakaway = {}, double viscous = 0) {
  JointFriction f;
  f.model = JointFriction::Model::sticking;
  f.coulomb = coulomb, f.static_effort = breakaway, f.viscous = viscous;
  return f;
}

// Efforts over time, per joint.
struct Pull : Controller {
  explicit Pull(std::function<double(double t, std::size_t joint)> f) : effort(std::move(f)) {}
  void update(const ControlInput& in, ControlCommand& command) override {
    for (std::size_t j = 0; j < command.effort.size(); ++j) command.effort[j] = effort(in.time, j);
  }
  std::function<double(double, std::size_t)> effort;
};

PhaseSetup pulled(const Model& model, std::function<double(double, std::size_t)> effort) {
  PhaseSetup setup;
  setup.drives.resize(model.joints().size());
  for (JointDrive& drive : setup.drives) drive.control = JointControl::controller;
  setup.controller = std::make_shared<Pull>(std::move(effort));
  return setup;
}

// Coulomb friction decelerates a wheel uniformly until it stops at t = J w0 / c and stays at rest. It dissipates the
// wheel's energy.
TEST(JointModes, FrictionStopsAndHoldsWheel) {
  constexpr double c = 0.5, w0 = 2, stop = kWheelInertia * w0 / c;
  const Model model = flywheel(sticking(c));
  for (double sense : {1.0, -1.0}) {
    PhaseDynamics dynamics(model, {});
    const PhaseOutcome o =
        simulate_phase(dynamics, {turning(model, sense * w0), 0, 20, 0.25}, {}, {.observe = [&](const auto& s) {
                         const double t = std::min(s.time, stop);
                         EXPECT_NEAR(s.state.v[0], sense * (w0 - c / kWheelInertia * t), 1e-11);  // measured 1e-12
                         EXPECT_NEAR(s.state.q[0], sense * (w0 * t - 0.5 * c / kWheelInertia * t * t), 1e-10);
                         if (s.time <= stop) return;
                         EXPECT_EQ(s.state.v[0], 0);
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_NEAR(o.integrals.friction_work, -0.5 * kWheelInertia * w0 * w0, 1e-10);
    ASSERT_EQ(o.integrals.joints.size(), 1U);
    EXPECT_NEAR(o.integrals.joints[0].friction_work, o.integrals.friction_work, 1e-12);
    EXPECT_EQ(dynamics.joint_modes().joints()[0].sticks_count, 1);
    EXPECT_EQ(dynamics.joint_modes().joints()[0].mode, JointModes::Mode::held);
  }
}

// Friction holds a linearly increasing effort up to the breakaway effort. Then the wheel accelerates by the effort in
// excess of Coulomb friction.
TEST(JointModes, BreakAwayAtStaticEffort) {
  constexpr double c = 0.5, s = 0.8, rate = 0.1, leaves = s / rate;
  const Model model = flywheel(sticking(c, s));
  for (double sense : {1.0, -1.0}) {
    PhaseDynamics dynamics(model, pulled(model, [&](double t, std::size_t) { return sense * rate * t; }));
    const PhaseOutcome o =
        simulate_phase(dynamics, {turning(model, 0), 0, 12, 0.5}, {}, {.observe = [&](const PhaseSample& x) {
                         const double t = x.time;
                         if (t < leaves) {
                           EXPECT_EQ(x.state.v[0], 0);
                           EXPECT_NEAR(x.friction[0], -sense * rate * t, 1e-14);  // holding effort
                         } else {
                           const double slid = 0.5 * rate * (t * t - leaves * leaves) - c * (t - leaves);
                           EXPECT_NEAR(x.state.v[0], sense * slid / kWheelInertia, 1e-10);
                         }
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_EQ(dynamics.joint_modes().joints()[0].breakaways, 1);
  }
  PhaseDynamics below(model, pulled(model, [](double, std::size_t) { return 0.8 * (1 - 1e-9); }));
  EXPECT_EQ(simulate_phase(below, {turning(model, 0), 0, 5}).end_state.v[0], 0);
  PhaseDynamics above(model, pulled(model, [](double, std::size_t) { return 0.8 * (1 + 1e-9); }));
  EXPECT_NEAR(simulate_phase(above, {turning(model, 0), 0, 5}).end_state.v[0], 5 * 0.3 / kWheelInertia, 1e-8);
}

// Two sliders in series on the ground, without gravity along them.
Model sliders(const JointFriction& first, const JointFriction& second, std::optional<JointLimits> limits = {}) {
  BodyDescription ground, a, b;
  ground.name = ground.joint.name = "ground";
  ground.joint.type = JointType::fixed;
  ground.mass = 1, ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  a.name = a.joint.name = "a", a.parent = "ground";
  a.joint.type = JointType::prismatic, a.joint.axis = {1, 0, 0};
  a.mass = 2, a.inertia = Symmetric3d::diagonal(1, 1, 1);
  b = a;
  b.name = b.joint.name = "b", b.parent = "a", b.mass = 3;
  a.joint.friction = first, b.joint.friction = second;
  if (limits) b.joint.limits = *limits;
  return ModelBuilder().add(ground).add(a).add(b).build();
}

// Two sliders in series with an effort on the first: the second sticks to it if its friction suffices, and slides
// otherwise.
TEST(JointModes, JointDecisionOfSlidingJoint) {
  const auto accelerations = [](double first, double second, double effort_on_first) {
    const Model model = sliders(sticking(first), sticking(second));
    PhaseDynamics dynamics(model, pulled(model, [=](double, std::size_t j) { return j == 0 ? effort_on_first : 0; }));
    const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 1});
    EXPECT_TRUE(o.finished) << o.failure;
    return o.end_state.v;
  };
  // 5 kg together: (8 - 3) / 5 = 1 m/s^2, which requires 3 N of b's friction.
  std::vector<double> v = accelerations(3, 3.01, 8);
  EXPECT_NEAR(v[0], 1, 1e-12);
  EXPECT_EQ(v[1], 0);
  // With 2.9 N it slides back: a has (8 - 3 - 2.9) / 2, b 2.9 / 3.
  v = accelerations(3, 2.9, 8);
  EXPECT_NEAR(v[0], (8 - 3 - 2.9) / 2, 1e-12);
  EXPECT_NEAR(v[1], 2.9 / 3 - (8 - 3 - 2.9) / 2, 1e-12);
  // With 2.99 N nothing moves.
  v = accelerations(3, 0.1, 2.99);
  EXPECT_EQ(v[0], 0);
  EXPECT_EQ(v[1], 0);
}

JointLimits stopped(double lower, double upper, double restitution, double rest_rate = 0) {
  JointLimits limits;
  limits.lower = lower, limits.upper = upper;
  limits.stop = JointStop{restitution, rest_rate};
  return limits;
}

// A block of 3 kg on the ground.
Model block(const JointLimits& limits, const JointFriction& friction = {}) {
  BodyDescription ground, b;
  ground.name = ground.joint.name = "ground";
  ground.joint.type = JointType::fixed;
  ground.mass = 1, ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  b.name = b.joint.name = "b", b.parent = "ground";
  b.joint.type = JointType::prismatic, b.joint.axis = {1, 0, 0};
  b.joint.limits = limits, b.joint.friction = friction;
  b.mass = 3, b.inertia = Symmetric3d::diagonal(1, 1, 1);
  return ModelBuilder().add(ground).add(b).build();
}

// A block pushed against a stop bounces: each flight lasts 2 v / a, each impact multiplies the speed by e. Without a
// rest rate the block would rest after v0 / a (1 + e) / (1 - e). Results do not depend on sampling, bit for bit.
TEST(JointModes, BounceGeometricallyAndRest) {
  constexpr double e = 0.6, height = 0.5, push = 6, mass = 3, a = push / mass, least = 1e-3;
  const Model model = block(stopped(-height, 10, e, least));
  const auto run = [&](double interval, std::vector<JointModes::StopImpact>& impacts) {
    PhaseDynamics dynamics(model, pulled(model, [](double, std::size_t) { return -push; }));
    const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 4, interval});
    EXPECT_TRUE(o.finished) << o.failure;
    impacts = dynamics.joint_modes().stop_impacts();
    EXPECT_EQ(dynamics.joint_modes().joints()[0].mode, JointModes::Mode::held);
    EXPECT_EQ(dynamics.joint_modes().joints()[0].end, JointModes::End::lower);
    return o;
  };
  std::vector<JointModes::StopImpact> impacts, others;
  const PhaseOutcome o = run(0, impacts);
  double t = std::sqrt(2 * height / a), v = a * t, lost = 0;
  for (std::size_t n = 0; n < impacts.size(); ++n) {
    SCOPED_TRACE(n);
    const double restitution = v < least ? 0 : e;
    EXPECT_NEAR(impacts[n].time, t, 1e-8);  // errors grow by 1 / e per bounce
    EXPECT_NEAR(impacts[n].rate_before, -v, 1e-8);
    EXPECT_NEAR(impacts[n].rate_after, restitution * v, 1e-8);
    EXPECT_NEAR(impacts[n].impulse, mass * v * (1 + restitution), 1e-8);
    EXPECT_NEAR(impacts[n].energy_lost, 0.5 * mass * v * v * (1 - restitution * restitution), 1e-8);
    lost += impacts[n].energy_lost;
    EXPECT_EQ(n + 1 == impacts.size(), v < least);
    v *= e, t += 2 * v / a;
  }
  EXPECT_GT(impacts.size(), 10U);
  EXPECT_NEAR(lost, push * height, 1e-8);  // the whole work of the push
  EXPECT_NEAR(o.integrals.motor_work, push * height, 1e-8);
  EXPECT_NEAR(o.integrals.friction_work, -lost, 1e-8);
  EXPECT_NEAR(o.end_state.q[0], -height, 1e-14);
  EXPECT_EQ(o.end_state.v[0], 0);
  EXPECT_EQ(run(0.01, others).end_state.q, o.end_state.q);
  ASSERT_EQ(others.size(), impacts.size());
  EXPECT_EQ(others.back().time, impacts.back().time);
}

// A joint at rest on its stop leaves it when the effort reverses. Until then the stop pushes.
TEST(JointModes, LeaveAStopWhenPulled) {
  const Model model = block(stopped(-1, 0, 0.5));
  // b rests on its upper stop under 2 (1 - t), until t = 1.
  PhaseDynamics dynamics(model, pulled(model, [](double t, std::size_t) { return 2 * (1 - t); }));
  const PhaseOutcome o =
      simulate_phase(dynamics, {zero_state(model), 0, 1.5, 0.125}, {}, {.observe = [](const PhaseSample& s) {
                       if (s.time >= 1) return;
                       EXPECT_EQ(s.state.v[0], 0);
                       EXPECT_NEAR(s.friction[0], -2 * (1 - s.time), 1e-13);
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(o.end_state.v[0], -0.5 * 0.5 / 3, 1e-10);  // -(t - 1)^2 / m
  EXPECT_EQ(dynamics.joint_modes().stop_impact_count(), 0);
}

// Adds sticking friction and stops to the joints of a random robot.
Model real(const Model& model, Random& random, double coulomb, double range, const State& state) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    if (has_one_axis(d.joint.type)) {
      d.joint.friction = sticking(coulomb * random.uniform(0.5, 1), coulomb * random.uniform(1, 1.5), 0.05);
      if (d.joint.type == JointType::continuous) d.joint.type = JointType::revolute;
      d.joint.limits.lower = state.q[b.q] - random.uniform(0.1, 1) * range;
      d.joint.limits.upper = state.q[b.q] + random.uniform(0.1, 1) * range;
      d.joint.limits.stop = JointStop{random.uniform(0, 0.9), 1e-3};
      if (d.joint.rotor_inertia > 0) d.joint.rotor_axis = random.direction();
    }
    builder.add(d);
  }
  return builder.build();
}

// Friction and stops of free-floating random robots dissipate energy and conserve momentum.
TEST(JointModes, ConserveMomentumAndBalanceEnergy) {
  long impacts = 0;
  int sticks = 0, breakaways = 0;
  double worst_momentum = 0, worst_energy = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.max_bodies = 7;
    const Model plain = random_model(options, random);
    const State state = random_state(plain, random, 1.0);
    const Model model = real(plain, random, 4.0, 0.8, state);
    PhaseSetup setup;
    if (i % 2)
      setup.drives =
          random_drives(model, state, i % 4 == 1 ? JointControl::pd : JointControl::computed_torque, 2, random);
    PhaseDynamics dynamics(model, setup);
    const Totals before = totals(model, state);
    ASSERT_GT(norm(before.momentum.angular), 1e-3);
    const PhaseOutcome o = simulate_phase(
        dynamics, {state, 0, 3, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
          const Totals now = totals(model, s.state);
          const double scale = std::max(before.energy, now.energy);
          worst_momentum = std::max(
              worst_momentum, norm(now.momentum.angular - before.momentum.angular) / norm(before.momentum.angular));
          worst_momentum = std::max(worst_momentum,
                                    norm(now.momentum.linear - before.momentum.linear) / norm(before.momentum.linear));
          const double work = s.integrals.motor_work + s.integrals.friction_work;
          worst_energy = std::max(worst_energy, std::abs(now.energy - before.energy - work) / scale);
        }});
    ASSERT_TRUE(o.finished) << o.failure;
    impacts += dynamics.joint_modes().stop_impact_count();
    double heat = 0, lost = 0;
    for (const JointModes::Joint& j : dynamics.joint_modes().joints())
      sticks += j.sticks_count, breakaways += j.breakaways, lost += j.stop_energy_lost;
    for (const JointIntegrals& j : o.integrals.joints) heat -= j.friction_work;
    EXPECT_NEAR(heat + lost, -o.integrals.friction_work, 1e-9 * (heat + lost));
  }
  EXPECT_LT(worst_momentum, 1e-11);  // measured 4e-15
  EXPECT_LT(worst_energy, 1e-9);     // measured 3e-12, over 129 impacts, 86 sticks
  EXPECT_GT(impacts, 10);
  EXPECT_GT(sticks, 10);
  EXPECT_GT(breakaways, 3);
}

// One stop impact of a free-floating robot dissipates (1 - e^2) u^2 / (2 (M^-1)_jj).
TEST(JointModes, EnergyLossFromMassMatrix) {
  Random random(3);
  RobotOptions options;
  options.min_bodies = options.max_bodies = 5;
  options.fixed_joints = false, options.prismatic_joints = false;
  const Model plain = random_model(options, random);
  State state = random_state(plain, random, 1.0);
  const Body& last = plain.bodies()[plain.joints().back()];
  state.v[last.v] = -0.7;
  ModelBuilder builder;
  for (const Body& b : plain.bodies()) {
    BodyDescription d = b.description;
    if (d.name == last.description.name) {
      d.joint.type = JointType::revolute;
      d.joint.limits.lower = state.q[b.q], d.joint.limits.upper = state.q[b.q] + 3;
      d.joint.limits.stop = JointStop{0.4, 0};
    }
    if (d.joint.rotor_inertia > 0) d.joint.rotor_axis = random.direction();
    builder.add(d);
  }
  const Model model = builder.build();
  PhaseDynamics dynamics(model, {});
  std::vector<double> y = dynamics.initial(state, 0);
  const Totals before = totals(model, state);
  dynamics.apply_stop_impacts(0, y);
  State after = state;
  std::copy_n(y.begin(), after.q.size(), after.q.begin());
  std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(after.q.size()), after.v.size(), after.v.begin());
  const Totals now = totals(model, after);
  const Eigen::MatrixXd inverse = mass_matrix(model, state).inverse();
  const double lost = 0.5 * 0.7 * 0.7 * (1 - 0.4 * 0.4) / inverse(last.v, last.v);
  EXPECT_NEAR(after.v[last.v], 0.4 * 0.7, 1e-15);
  EXPECT_NEAR(before.energy - now.energy, lost, 1e-13 * before.energy);
  EXPECT_LT(norm(now.momentum.angular - before.momentum.angular), 1e-13 * norm(before.momentum.angular));
  EXPECT_LT(norm(now.momentum.linear - before.momentum.linear), 1e-13 * norm(before.momentum.linear));
  ASSERT_EQ(dynamics.joint_modes().stop_impacts().size(), 1U);
  EXPECT_NEAR(dynamics.joint_modes().stop_impacts()[0].energy_lost, lost, 1e-13 * before.energy);
}

// Several joints are at their stops simultaneously: approaching, at rest or separating. Stops only push, and no joint
// penetrates its stop. Joints that hit a stop rebound with the minimum restitution of all.
TEST(JointModes, SimultaneousStopsOnlyPush) {
  int together = 0, pulled = 0;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = options.max_bodies = 5;
    options.fixed_joints = false, options.prismatic_joints = false;
    const Model plain = random_model(options, random);
    State state = random_state(plain, random, 1.0);
    ModelBuilder builder;
    for (const Body& b : plain.bodies()) {
      BodyDescription d = b.description;
      if (has_one_axis(d.joint.type)) {
        d.joint.type = JointType::revolute;
        const bool upper = random.uniform(0, 1) > 0.5;
        d.joint.limits.lower = state.q[b.q] - (upper ? 1.0 : 0.0);
        d.joint.limits.upper = state.q[b.q] + (upper ? 0.0 : 1.0);
        d.joint.limits.stop = JointStop{random.uniform(0, 0.9), 0};
        if (random.uniform(0, 1) > 0.6) state.v[b.v] = 0;
      }
      builder.add(d);
    }
    const Model model = builder.build();
    PhaseDynamics dynamics(model, {});
    std::vector<double> y = dynamics.initial(state, 0);
    dynamics.apply_stop_impacts(0, y);
    const Eigen::Map<const Eigen::VectorXd> v(y.data() + state.q.size(), static_cast<Eigen::Index>(state.v.size()));
    const Eigen::Map<const Eigen::VectorXd> before(state.v.data(), static_cast<Eigen::Index>(state.v.size()));
    const Eigen::VectorXd impulse = mass_matrix(model, state) * (v - before);
    double least = 1;
    int arrived = 0;
    for (int b : model.joints()) {
      const Body& body = model.bodies()[b];
      const double end = state.q[body.q] == body.description.joint.limits.upper ? 1 : -1;
      if (end * before[body.v] <= 0) continue;
      ++arrived, least = std::min(least, body.description.joint.limits.stop->restitution);
    }
    together += arrived > 1;
    for (int b : model.joints()) {
      const Body& body = model.bodies()[b];
      const double end = state.q[body.q] == body.description.joint.limits.upper ? 1 : -1;
      if (arrived == 0) continue;
      EXPECT_LT(end * impulse[body.v], 1e-12);  // away from the end
      EXPECT_LT(end * v[body.v], 1e-12);
      if (std::abs(impulse[body.v]) > 1e-9 && end * before[body.v] > 0) {
        EXPECT_NEAR(v[body.v], -least * before[body.v], 1e-13);
      }
      pulled += std::abs(impulse[body.v]) < 1e-12;
    }
  }
  EXPECT_GT(together, 50);
  EXPECT_GT(pulled, 50);  // stops without impulse
}

// Held joints among several at rest have efforts within their static friction. Joints that slip accelerate against
// their friction.
TEST(JointModes, HoldIfPossibleElseFree) {
  int held = 0, freed = 0;
  for (int i = 0; i < 400; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = options.max_bodies = 6;
    options.fixed_joints = false;
    const Model plain = random_model(options, random);
    State state = random_state(plain, random, 1.0);
    ModelBuilder builder;
    for (const Body& b : plain.bodies()) {
      BodyDescription d = b.description;
      if (has_one_axis(d.joint.type)) {
        d.joint.friction = sticking(1, 1.2);
        state.v[b.v] = 0;
      }
      builder.add(d);
    }
    const Model model = builder.build();
    std::vector<double> pulls;
    for (std::size_t j = 0; j < model.joints().size(); ++j) pulls.push_back(random.uniform(-4, 4));
    const auto pull = [&](double, std::size_t j) { return pulls[j]; };
    PhaseDynamics dynamics(model, testing::joint_modes_test::pulled(model, pull));
    const std::vector<double> y = dynamics.initial(state, 0);
    dynamics.begin_control(0, 1);
    dynamics.choose_modes(0, y);
    std::vector<double> motor(model.joints().size()), friction(motor);
    dynamics.efforts(0, y, motor, friction);
    for (const JointModes::Joint& j : dynamics.joint_modes().joints()) {
      if (j.mode == JointModes::Mode::held) {
        ++held;
        EXPECT_LT(std::abs(friction[j.joint]), 1.2 * (1 + 1e-10));
        EXPECT_EQ(dynamics.acceleration()[j.v], 0);
      } else {
        ++freed;
        EXPECT_GT(j.sense * dynamics.acceleration()[j.v], 0);
        EXPECT_NEAR(friction[j.joint], -j.sense, 1e-15);
      }
    }
  }
  EXPECT_GT(held, 300);
  EXPECT_GT(freed, 300);
}

// Sampled control with stuck joints and stops: work and energy balance as for continuous control.
TEST(JointModes, WorkUnderSampledControl) {
  const Model model = sliders(sticking(1.0, 1.4), sticking(0.5), stopped(-0.2, 0.2, 0.3, 1e-4));
  PhaseSetup setup;
  setup.drives.resize(2);
  for (JointDrive& d : setup.drives) d.control = JointControl::pd, d.kp = 30, d.kd = 4;
  setup.drives[0].trajectory = JointTrajectory::at_rest(0.1);
  setup.drives[1].trajectory = JointTrajectory::at_rest(0.5);  // beyond its stop
  setup.clock = std::make_shared<ControlClock>(ControlTiming{0.01, 0.002}, 2);
  PhaseDynamics dynamics(model, setup);
  const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 5});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_EQ(dynamics.joint_modes().joints()[1].end, JointModes::End::upper);
  EXPECT_EQ(o.end_state.v[0], 0);
  EXPECT_EQ(o.end_state.v[1], 0);
  EXPECT_NEAR(o.integrals.motor_work + o.integrals.friction_work, 0, 1e-10 * o.integrals.motor_work);
  EXPECT_GT(std::abs(o.end_state.q[0] - 0.1), 1e-4);  // friction leaves an error of up to static / kp
  EXPECT_LT(std::abs(o.end_state.q[0] - 0.1), 0.1);
}

// A four-bar linkage on the ground with a sticking crank, under gravity, comes to rest with its loop closed.
TEST(JointModes, StickInClosedLoop) {
  const auto link = [](const char* name, const char* parent, double at, double length) {
    BodyDescription b;
    b.name = b.joint.name = name, b.parent = parent;
    b.X_PF.p = {at, 0, 0};
    b.joint.type = JointType::revolute;
    b.mass = 3 * length, b.com = {length / 2, 0, 0};
    b.inertia = Symmetric3d::diagonal(0.01, 0.1, 0.1);
    return b;
  };
  BodyDescription ground;
  ground.name = ground.joint.name = "ground", ground.joint.type = JointType::fixed;
  ground.mass = 1, ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  BodyDescription left = link("left", "ground", 0, 1), right = link("right", "ground", 2, 1);
  left.joint.friction = sticking(4, 6), right.joint.limits = stopped(0.9, 9, 0.5, 1e-3);
  const Model model = ModelBuilder().add(ground).add(left).add(link("bar", "left", 1, 2)).add(right).build();
  PhaseSetup setup;
  LoopClosure pin;
  pin.name = "pin", pin.model = GraspModel::hinge;
  pin.body_a = model.body_index("right"), pin.X_AC = {Rotationd::identity(), {1, 0, 0}};
  pin.body_b = model.body_index("bar"), pin.X_BD = {Rotationd::identity(), {2, 0, 0}};
  setup.closures = {pin};
  setup.gravity = {4, 0, 0};
  State state = zero_state(model);  // a parallelogram, upright
  const auto at = [&](const char* name) { return model.bodies()[model.body_index(name)].q; };
  const auto v_at = [&](const char* name) { return model.bodies()[model.body_index(name)].v; };
  state.q[at("left")] = state.q[at("right")] = 1.5, state.q[at("bar")] = -1.5;
  const auto run = [&](double rate) {
    State s = state;
    s.v[v_at("left")] = s.v[v_at("right")] = rate, s.v[v_at("bar")] = -rate;
    PhaseDynamics dynamics(model, setup);
    const auto energy = [&](const State& x) {
      const Kinematics k = forward_kinematics(model, x);
      return kinetic_energy(model, k, x) - model.mass() * dot(setup.gravity, center_of_mass(model, k));
    };
    PhaseOutcome o =
        simulate_phase(dynamics, {s, 0, 4, 0.125}, {}, {.observe = [&](const PhaseSample& x) {
                         EXPECT_NEAR(energy(x.state) - energy(s), x.integrals.friction_work, 1e-9);  // measured 1e-11
                         EXPECT_NEAR(x.state.q[at("left")], x.state.q[at("right")], 1e-12);
                       }});
    EXPECT_TRUE(o.finished) << o.failure;
    for (double w : o.end_state.v) EXPECT_NEAR(w, 0, 1e-12);
    return o;
  };
  // Coupler and cranks weigh 3 * 0.5 * 2 + 6 * 1 = 9 kg m; at 1.5 rad that is 9 * 4 * sin(1.5) N m, which exceeds the
  // friction: the linkage falls onto the stop of the other crank.
  const PhaseOutcome falls = run(-1);
  EXPECT_NEAR(falls.end_state.q[at("right")], 0.9, 1e-9);
  setup.gravity = {0.4, 0, 0};  // friction holds a tenth of the load
  const PhaseOutcome stays = run(-1);
  EXPECT_GT(stays.end_state.q[at("left")], 0.95);
  EXPECT_LT(stays.end_state.q[at("left")], 1.49);
}

// On a torque-speed line the wheel's rate is w0 (1 - exp(-t / T)) with T = J w0 / tau. The copper loss is the integral
// of R i^2. Sampled control changes neither.
TEST(JointMotors, FollowTorqueSpeedLine) {
  constexpr double most = 2, w0 = 5, k = 0.1, R = 0.4, T = kWheelInertia * w0 / most;
  BodyDescription ground, wheel;
  const Model plain = flywheel({}, most);
  for (const Body& b : plain.bodies()) (b.parent < 0 ? ground : wheel) = b.description;
  wheel.joint.motor = JointMotor{w0, {}, k, R};
  const Model model = ModelBuilder().add(ground).add(wheel).build();
  for (const auto& [sampled, direction] : {std::pair{false, 1.0}, {true, 1.0}, {false, -1.0}}) {
    PhaseSetup setup = pulled(model, [&, sense = direction](double, std::size_t) { return sense * 100.0; });
    if (sampled) setup.clock = std::make_shared<ControlClock>(ControlTiming{0.5, 0}, 1);
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 0), 0, 10});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_NEAR(o.end_state.v[0], direction * w0 * (1 - std::exp(-10 / T)), 1e-9);
    const double stall = most / (3 * k);  // [A]; the gear ratio is 3
    EXPECT_NEAR(o.integrals.joints[0].copper_loss, R * stall * stall * T / 2 * (1 - std::exp(-20 / T)), 1e-7);
    EXPECT_NEAR(o.integrals.joints[0].motor_work, 0.5 * kWheelInertia * o.end_state.v[0] * o.end_state.v[0], 1e-9);
  }
}

// Ripple does the work tau (theta + A / k (cos phase - cos(k theta + phase))), and does not affect the copper loss.
TEST(JointMotors, RippleWithTheirAngle) {
  BodyDescription ground, wheel;
  const Model plain = flywheel({});
  for (const Body& b : plain.bodies()) (b.parent < 0 ? ground : wheel) = b.description;
  constexpr double k_t = 0.1, R = 0.4, phase = 0.7;
  wheel.joint.motor = JointMotor{};
  wheel.joint.motor->torque_constant = k_t, wheel.joint.motor->resistance = R;
  wheel.joint.motor->ripple = TorqueRipple{0.3, 2, phase};
  const Model model = ModelBuilder().add(ground).add(wheel).build();
  constexpr double tau = 1.5, k = 2 * 3;
  PhaseDynamics dynamics(model, pulled(model, [](double, std::size_t) { return tau; }));
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 0), 0, 5});
  ASSERT_TRUE(o.finished) << o.failure;
  const double theta = o.end_state.q[0],
               work = tau * (theta + 0.3 / k * (std::cos(phase) - std::cos(k * theta + phase)));
  EXPECT_GT(theta, 3);
  EXPECT_NEAR(0.5 * kWheelInertia * o.end_state.v[0] * o.end_state.v[0], work, 1e-9);
  const double current = tau / (3 * k_t);  // the gear ratio is 3
  EXPECT_NEAR(o.integrals.joints[0].copper_loss, R * current * current * 5, 1e-11);
}

}  // namespace joint_modes_test
}  // namespace grapnel::testing
