/// Joint control: prescribed motion, PD with limits, friction, and their work.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace joint_control_test {

TEST(Friction, ViscousSlowsExponentially) {
  const Model model = flywheel({0.3, 0, 1e-3});
  PhaseDynamics dynamics(model, {});
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 2), 0, 5});
  ASSERT_TRUE(o.finished);
  const double rate = 2 * std::exp(-0.3 * 5 / kWheelInertia);
  EXPECT_NEAR(o.end_state.v[0], rate, 1e-12);
  EXPECT_NEAR(o.integrals.friction_work, kWheelInertia / 2 * (rate * rate - 4), 1e-11);
  EXPECT_EQ(o.integrals.motor_work, 0);
}

TEST(Friction, CoulombSlowsSteadilyUntilItStops) {
  const Model model = flywheel({0, 0.5, 1e-3});
  PhaseDynamics dynamics(model, {});
  const PhaseOutcome moving = simulate_phase(dynamics, {turning(model, 2), 0, 5});
  EXPECT_NEAR(moving.end_state.v[0], 2 - 0.5 * 5 / kWheelInertia, 1e-12);
  const PhaseOutcome stopped = simulate_phase(dynamics, {turning(model, -2), 0, 14});
  ASSERT_TRUE(stopped.finished);
  EXPECT_LT(std::abs(stopped.end_state.v[0]), 1e-6);
  EXPECT_NEAR(stopped.integrals.friction_work, -kWheelInertia / 2 * 4, 1e-10);
}

TEST(EffortLimit, SaturatesAndAcceleratesByIt) {
  const Model model = flywheel({}, 0.2);
  PhaseSetup setup;
  setup.drives.resize(1);
  setup.drives[0] = {JointControl::pd, JointTrajectory::at_rest(5), 49, 14};
  PhaseDynamics dynamics(model, setup);
  int samples = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {turning(model, 0), 0, 3, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                       EXPECT_EQ(s.motor[0], 0.2);
                       EXPECT_NEAR(s.state.v[0], 0.2 / kWheelInertia * s.time, 1e-13);
                       ++samples;
                     }});
  EXPECT_TRUE(o.finished);
  EXPECT_EQ(samples, 31);
  EXPECT_NEAR(o.integrals.motor_work, kWheelInertia / 2 * std::pow(0.6 / kWheelInertia, 2), 1e-13);
  setup.drives[0].trajectory = JointTrajectory::at_rest(-5);
  PhaseDynamics other(model, setup);
  simulate_phase(other, {turning(model, 0), 0, 1, 0.1}, {},
                 {.observe = [](const PhaseSample& s) { EXPECT_EQ(s.motor[0], -0.2); }});
}

// 2 kg m^2 + rotor under PD towards 1 rad: the damped oscillator in closed form.
TEST(PD, IsTheDampedOscillator) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives = {{JointControl::pd, JointTrajectory::at_rest(1), 20, 2}};
  PhaseDynamics dynamics(model, setup);
  const double damping = 2 / (2 * kWheelInertia), w = std::sqrt(20 / kWheelInertia - damping * damping);
  simulate_phase(dynamics, {turning(model, 0), 0, 6, 0.25}, {}, {.observe = [&](const PhaseSample& s) {
                   const double e = std::exp(-damping * s.time);
                   EXPECT_NEAR(s.state.q[0], 1 - e * (std::cos(w * s.time) + damping / w * std::sin(w * s.time)),
                               1e-11);
                   EXPECT_NEAR(s.motor[0], 20 * (1 - s.state.q[0]) - 2 * s.state.v[0], 1e-14);  // products may be fused
                 }});
}

TEST(PrescribedJoints, FollowTheirPathExactly) {
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const Model model = random_model({}, random);
    const State start = random_state(model, random, 0.5);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::prescribed, 2, random, 3);
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o = simulate_phase(dynamics, {start, 3, 5, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                                            for (std::size_t j = 0; j < model.joints().size(); ++j) {
                                              const Body& body = model.bodies()[model.joints()[j]];
                                              const JointPoint p = evaluate(setup.drives[j].trajectory, s.time);
                                              EXPECT_EQ(s.state.q[body.q], p.position);
                                              EXPECT_EQ(s.state.v[body.v], p.rate);
                                            }
                                          }});
    ASSERT_TRUE(o.finished) << o.failure;
  }
}

// A stiffer PD control tracks more closely; its limit is the motion with prescribed joints.
TEST(PD, ConvergesToIdealTracking) {
  SKIP_UNDER_SANITIZERS();
  Random random(5);
  RobotOptions options;
  options.min_bodies = 7, options.max_bodies = 7;
  const Model model = random_model(options, random);
  const State start = random_state(model, random, 0.3);
  PhaseSetup setup;
  setup.drives = random_drives(model, start, JointControl::prescribed, 3, random);
  PhaseDynamics ideal(model, setup);
  const State reference = simulate_phase(ideal, {start, 0, 3}).end_state;
  const auto error = [&](double stiffness) {
    PhaseSetup pd = setup;
    for (JointDrive& d : pd.drives) d.control = JointControl::pd, d.kp = stiffness, d.kd = 2 * std::sqrt(stiffness * 5);
    PhaseDynamics dynamics(model, pd);
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 3});
    EXPECT_TRUE(o.finished) << o.failure;
    return difference(o.end_state, reference);
  };
  const double soft = error(1e4), hard = error(1e6);
  std::printf("[ measured ] PD against ideal tracking: %.3g at 1e4, %.3g at 1e6\n", soft, hard);
  EXPECT_LT(soft, 0.1);
  EXPECT_LT(hard, 1e-3);
  EXPECT_LT(hard, soft / 8);  // the lag decreases at least like kd/kp
}

struct Mode {
  const char* name;
  JointControl control;
};
void PrintTo(const Mode& value, std::ostream* out) { *out << value.name; }
class Work : public ::testing::TestWithParam<Mode> {};
INSTANTIATE_TEST_SUITE_P(Controls, Work,
                         ::testing::Values(Mode{"free", JointControl::free}, Mode{"pd", JointControl::pd},
                                           Mode{"prescribed", JointControl::prescribed}),
                         [](const auto& test) { return test.param.name; });

// T(t) - T(0) = work of motors and friction, on robots with friction and rotors.
TEST_P(Work, EqualsChangeOfEnergy) {
  Worst worst(std::string("work-energy over the largest energy, ") + GetParam().name);
  double motors = 0;
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.max_bodies = 10;
    options.targets = i % 2;
    const Model model = with_friction(random_model(options, random), 0.5, 0.3, i % 3 == 0 ? 5.0 : 1e9);
    if (model.joints().empty()) continue;
    const State start = random_state(model, random, 0.5);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, GetParam().control, 2, random);
    PhaseDynamics dynamics(model, setup);
    const double before = totals(model, start).energy;
    double largest = before, off = 0, friction_before = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {start, 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                         const double T = totals(model, s.state).energy;
                         largest = std::max(largest, T);
                         off = std::max(off, std::abs(T - before - s.integrals.motor_work - s.integrals.friction_work));
                         EXPECT_LE(s.integrals.friction_work, friction_before);  // friction never adds energy
                         friction_before = s.integrals.friction_work;
                         EXPECT_EQ(s.integrals.external_work, 0);
                         for (std::size_t j = 0; j < s.friction.size(); ++j) {
                           EXPECT_LE(s.friction[j] * s.state.v[model.bodies()[model.joints()[j]].v], 0);
                           if (GetParam().control != JointControl::prescribed && i % 3 == 0) {
                             EXPECT_LE(std::abs(s.motor[j]), 5.0);
                           }
                         }
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_LT(o.integrals.friction_work, 0);
    motors = std::max(motors, std::abs(o.integrals.motor_work));
    EXPECT_LT(worst.note(off / largest, i), 1e-9);
  }
  if (GetParam().control == JointControl::free) {
    EXPECT_EQ(motors, 0);
  }
  if (GetParam().control != JointControl::free) {
    EXPECT_GT(motors, 1);
  }
}

// The integrals of the phase against Simpson's rule over the samples.
TEST_P(Work, EqualsIntegralOfPower) {
  Random random(11);
  RobotOptions options;
  options.min_bodies = 6, options.max_bodies = 8;
  const Model model = with_friction(random_model(options, random), 0.5, 0.3);
  const State start = random_state(model, random, 0.5);
  PhaseSetup setup;
  setup.drives = random_drives(model, start, GetParam().control, 2, random);
  PhaseDynamics dynamics(model, setup);
  std::vector<double> motor, friction;
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 2, 0.002}, {}, {.observe = [&](const PhaseSample& s) {
                                          motor.push_back(0), friction.push_back(0);
                                          for (std::size_t j = 0; j < s.motor.size(); ++j) {
                                            const double rate = s.state.v[model.bodies()[model.joints()[j]].v];
                                            motor.back() += s.motor[j] * rate, friction.back() += s.friction[j] * rate;
                                          }
                                        }});
  ASSERT_TRUE(o.finished);
  ASSERT_EQ(motor.size(), 1001u);
  const auto simpson = [](const std::vector<double>& y) {
    double sum = y.front() + y.back();
    for (std::size_t i = 1; i + 1 < y.size(); ++i) sum += (i % 2 == 1 ? 4 : 2) * y[i];
    return sum * 0.002 / 3;
  };
  const double scale = std::abs(o.integrals.motor_work) + std::abs(o.integrals.friction_work);
  ASSERT_GT(scale, 0.01);
  EXPECT_NEAR(simpson(motor), o.integrals.motor_work, 1e-6 * scale);
  EXPECT_NEAR(simpson(friction), o.integrals.friction_work, 1e-6 * scale);
}

TEST(PhaseDynamics, RejectsInvalidDrivesAndRoots) {
  const Model model = flywheel({});
  const auto message = [&](const PhaseSetup& setup) -> std::string {
    try {
      PhaseDynamics(model, setup);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  PhaseSetup setup;
  setup.drives.resize(2);
  EXPECT_EQ(message(setup), "PhaseDynamics: one drive per joint is needed");
  setup.drives.clear();
  setup.held_root = 0;
  EXPECT_EQ(message(setup), "PhaseDynamics: only a free root can be held");
  setup.held_root = -1;
  EXPECT_EQ(message(setup), "accepted");
}

}  // namespace joint_control_test
}  // namespace grapnel::testing
