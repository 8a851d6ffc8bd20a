/// Computed-torque control: exact tracking, decay of errors, limits, friction, combination with other controls.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace computed_torque_test {

constexpr double kStiffness = 25, kDamping = 10;  // critically damped: both poles at -5 1/s

void set_gains(std::vector<JointDrive>& drives) {
  for (JointDrive& d : drives) {
    if (d.control == JointControl::computed_torque) d.kp = kStiffness, d.kd = kDamping;
  }
}
// Environment known to the controller, selected by i: a held base, gravity, or loads with attitude control.
void surround(const Model& model, int i, PhaseSetup& setup, State& start, Random& random) {
  const int base = model.body_index("b0");
  if (i % 4 == 1) {
    setup.held_root = base;
    set_root_twist(model, base, Twistd::zero(), start);
  }
  if (i % 4 == 2) setup.gravity = {0.4, -0.2, -3};
  if (i % 4 == 3) {
    ExternalLoad load;
    load.body = static_cast<int>(model.bodies().size()) - 1;
    load.p_BP = random.vector(0.3), load.frame = LoadFrame::body;
    load.amplitude = {random.vector(1), random.vector(3)};
    load.profile.start = 0.5, load.profile.end = 1.1;
    setup.loads = {load};
    setup.attitude = {base, random.rotation(), {10, 10, 10}, {5, 5, 5}};
  }
}

// Largest position or rate error of the joints under this control.
double tracking_error(const Model& model, const PhaseSetup& setup, const PhaseSample& s, JointControl control) {
  double largest = 0;
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    if (setup.drives[j].control != control) continue;
    const Body& body = model.bodies()[model.joints()[j]];
    const JointPoint p = evaluate(setup.drives[j].trajectory, s.time);
    largest = std::max({largest, std::abs(s.state.q[body.q] - p.position), std::abs(s.state.v[body.v] - p.rate)});
  }
  return largest;
}

TEST(ComputedTorque, TracksExactlyFromMatchingStart) {
  Worst tracking("joints under computed torque off their paths"), ideal("base against prescribed joints");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 3, options.max_bodies = 10;
    options.targets = i % 2;
    const Model model = random_model(options, random);
    State start = random_state(model, random, 0.3);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::computed_torque, 2, random);
    set_gains(setup.drives);
    surround(model, i, setup, start, random);
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o = simulate_phase(
        dynamics, {start, 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
          EXPECT_LT(tracking.note(tracking_error(model, setup, s, JointControl::computed_torque), i), 1e-10);
        }});
    ASSERT_TRUE(o.finished) << o.failure;
    for (JointDrive& d : setup.drives) d.control = JointControl::prescribed;
    PhaseDynamics prescribed(model, setup);
    const PhaseOutcome p = simulate_phase(prescribed, {start, 0, 2});
    EXPECT_LT(ideal.note(difference(o.end_state, p.end_state), i), 1e-9);
    EXPECT_NEAR(o.integrals.motor_work, p.integrals.motor_work, 1e-9 * (1 + std::abs(p.integrals.motor_work)));
  }
}

// The error of every joint separately satisfies x'' + 10 x' + 25 x = 0.
TEST(ComputedTorque, ErrorsDecayAsASecondOrderSystem) {
  Worst worst("errors against (e0 + (v0 + 5 e0) t) exp(-5 t)");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 4, options.max_bodies = 8;
    const Model model = random_model(options, random);
    State start = random_state(model, random, 0.3);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::computed_torque, 1.5, random);
    set_gains(setup.drives);
    surround(model, i, setup, start, random);
    std::vector<double> e0, v0;
    for (int b : model.joints()) {
      const Body& body = model.bodies()[b];
      e0.push_back(random.uniform(-0.2, 0.2)), v0.push_back(random.uniform(-0.2, 0.2));
      start.q[body.q] += e0.back(), start.v[body.v] += v0.back();
    }
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o =
        simulate_phase(dynamics, {start, 0, 1.5, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                         for (std::size_t j = 0; j < e0.size(); ++j) {
                           const Body& body = model.bodies()[model.joints()[j]];
                           const JointPoint p = evaluate(setup.drives[j].trajectory, s.time);
                           const double e = (e0[j] + (v0[j] + 5 * e0[j]) * s.time) * std::exp(-5 * s.time);
                           EXPECT_LT(worst.note(std::abs(s.state.q[body.q] - p.position - e), i), 1e-10);
                         }
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
  }
}

TEST(ComputedTorque, SaturatesAtEffortLimit) {
  Worst worst("work-energy where torques are cut");
  int cut = 0, free = 0;
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 4, options.max_bodies = 7;
    const double limit = 1.5;
    const Model model = with_friction(random_model(options, random), 0, 0, limit);
    const State start = random_state(model, random, 0.2);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::computed_torque, 2, random);
    set_gains(setup.drives);
    PhaseDynamics dynamics(model, setup);
    const double before = totals(model, start).energy;
    double largest = before, off = 0;
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 2, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
                                            for (double torque : s.motor) {
                                              EXPECT_LE(std::abs(torque), limit);
                                              ++(std::abs(torque) == limit ? cut : free);
                                            }
                                            const double T = totals(model, s.state).energy;
                                            largest = std::max(largest, T);
                                            off = std::max(off, std::abs(T - before - s.integrals.motor_work));
                                          }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_LT(worst.note(off / largest, i), 1e-9);
  }
  EXPECT_GT(cut, 50);
  EXPECT_GT(free, 50);
}

// A wheel far from its reference: maximum torque, motion in closed form.
TEST(ComputedTorque, SaturatedTorqueAccelerates) {
  const Model model = flywheel({}, 0.2);
  PhaseSetup setup;
  setup.drives = {{JointControl::computed_torque, JointTrajectory::at_rest(5), 25, 10}};
  PhaseDynamics dynamics(model, setup);
  simulate_phase(dynamics, {turning(model, 0), 0, 2, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                   EXPECT_EQ(s.motor[0], 0.2);
                   EXPECT_NEAR(s.state.v[0], 0.2 / kWheelInertia * s.time, 1e-13);
                 }});
}

// The controller does not compensate friction: theta'' = kp (1 - theta) - (kd + c/I) theta'.
TEST(ComputedTorque, FrictionDisturbsIt) {
  const double viscous = 1.3, kp = 9, kd = 2;
  const Model model = flywheel({viscous, 0, 1e-3});
  PhaseSetup setup;
  setup.drives = {{JointControl::computed_torque, JointTrajectory::at_rest(1), kp, kd}};
  PhaseDynamics dynamics(model, setup);
  const PhaseOutcome o =
      simulate_phase(dynamics, {turning(model, 0), 0, 3, 0.25}, {}, {.observe = [&](const PhaseSample& s) {
                       const double error = damped_oscillation(-1, 0.5 * (kd + viscous / kWheelInertia), kp, s.time);
                       EXPECT_NEAR(s.state.q[0], 1 + error, 1e-11);
                       EXPECT_NEAR(s.motor[0], kWheelInertia * (kp * (1 - s.state.q[0]) - kd * s.state.v[0]), 1e-12);
                       EXPECT_EQ(s.friction[0], -viscous * s.state.v[0]);
                     }});
  EXPECT_LT(o.integrals.friction_work, -0.1);
  EXPECT_NEAR(o.integrals.motor_work + o.integrals.friction_work,
              0.5 * kWheelInertia * o.end_state.v[0] * o.end_state.v[0], 1e-11);
}

// All four controls combined: computed torque tracks exactly only without friction. The energy balance holds in both
// cases.
TEST(ComputedTorque, CombinesWithOtherControls) {
  Worst tracking("computed torque beside free, PD and prescribed joints"), energy("work-energy of the mixture");
  Worst disturbed("the same with friction");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 6, options.max_bodies = 10;
    const Model model =
        i % 2 == 0 ? random_model(options, random) : with_friction(random_model(options, random), 0.4, 0.1);
    const State start = random_state(model, random, 0.3);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::computed_torque, 2, random);
    constexpr JointControl kControls[] = {JointControl::computed_torque, JointControl::prescribed, JointControl::pd,
                                          JointControl::free};
    for (std::size_t j = 0; j < setup.drives.size(); ++j) setup.drives[j].control = kControls[(j + i / 2) % 4];
    set_gains(setup.drives);
    PhaseDynamics dynamics(model, setup);
    const double before = totals(model, start).energy;
    double largest = before, off = 0, error = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {start, 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                         error = std::max(error, tracking_error(model, setup, s, JointControl::computed_torque));
                         EXPECT_EQ(tracking_error(model, setup, s, JointControl::prescribed), 0);
                         const double T = totals(model, s.state).energy;
                         largest = std::max(largest, T);
                         off = std::max(off, std::abs(T - before - s.integrals.motor_work - s.integrals.friction_work));
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_LT(energy.note(off / largest, i), 1e-9);
    if (i % 2 == 0) {
      EXPECT_LT(tracking.note(error, i), 1e-9);
    } else {
      disturbed.note(error, i);
    }
  }
  EXPECT_GT(disturbed.value(), 1e-3);
}

}  // namespace computed_torque_test
}  // namespace grapnel::testing
