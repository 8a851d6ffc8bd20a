/// Breaks: times at which trajectories or loads are not smooth. Integration steps end there.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/integrate/integrate.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace breaks_test {

using ::testing::ElementsAre;

constexpr double kJoin = 1.0 / 3;

// A robot with two cubic segments per joint and a jump in acceleration at the join.
struct Jumping {
  Model model;
  State start;
  PhaseSetup whole, first, second;  // the trajectories, and their two halves separately
};
Jumping jumping_robot(int i, JointControl control) {
  Random random(i);
  RobotOptions options;
  options.min_bodies = 5, options.max_bodies = 8;
  Jumping r{random_model(options, random), {}, {}, {}, {}};
  r.start = random_state(r.model, random, 0.3);
  for (int b : r.model.joints()) {
    const Body& body = r.model.bodies()[b];
    const double q = r.start.q[body.q], v = r.start.v[body.v];
    JointDrive d;
    d.control = control;
    d.kp = 30, d.kd = 9;
    d.trajectory = interpolate_samples(std::vector<double>{0, kJoin, 1},
                                       std::vector<double>{q, q + random.uniform(-0.3, 0.3), q + random.uniform(-1, 1)},
                                       std::vector<double>{v, random.uniform(-1, 1), random.uniform(-1, 1)});
    r.whole.drives.push_back(d);
    JointDrive half = d;
    half.trajectory.segments.pop_back();
    r.first.drives.push_back(half);
    half.trajectory.segments[0] = d.trajectory.segments[1];
    r.second.drives.push_back(half);
  }
  return r;
}

class Jump : public ::testing::TestWithParam<JointControl> {};
INSTANTIATE_TEST_SUITE_P(Controls, Jump,
                         ::testing::Values(JointControl::prescribed, JointControl::computed_torque, JointControl::pd),
                         [](const auto& test) {
                           return test.param == JointControl::prescribed ? "prescribed"
                                  : test.param == JointControl::pd       ? "pd"
                                                                         : "computed_torque";
                         });

TEST_P(Jump, IntegratesAsTwoPhases) {
  Worst worst("one phase with a jump against two"), back("there and back through a jump");
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Jumping r = jumping_robot(i, GetParam());
    PhaseDynamics whole(r.model, r.whole), first(r.model, r.first), second(r.model, r.second);
    const PhaseOutcome one = simulate_phase(whole, {r.start, 0, 1});
    const PhaseOutcome a = simulate_phase(first, {r.start, 0, kJoin});
    const PhaseOutcome b = simulate_phase(second, {a.end_state, kJoin, 1});
    ASSERT_TRUE(one.finished && b.finished);
    EXPECT_LT(worst.note(difference(one.end_state, b.end_state), i), 1e-10);
    EXPECT_NEAR(one.integrals.motor_work, a.integrals.motor_work + b.integrals.motor_work, 1e-9);
    // Two phases have two starts with short first steps; one phase with a break must not need more steps.
    EXPECT_LE(static_cast<double>(one.steps + one.rejected),
              1.05 * static_cast<double>(a.steps + a.rejected + b.steps + b.rejected) + 3);
    if (GetParam() == JointControl::pd) continue;  // PD damping is unstable backwards in time
    const PhaseOutcome returned = simulate_phase(whole, {one.end_state, 1, 0});
    ASSERT_TRUE(returned.finished);
    EXPECT_LT(back.note(difference(returned.end_state, r.start), i), 1e-9);
  }
}

// Integration of the same right-hand side across the jump, without a break, causes many rejected steps.
TEST(Breaks, SaveRejectedSteps) {
  long with = 0, apart = 0, without = 0;
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Jumping r = jumping_robot(i, JointControl::prescribed);
    PhaseDynamics dynamics(r.model, r.whole);
    with += simulate_phase(dynamics, {r.start, 0, 1}).rejected;
    PhaseDynamics first(r.model, r.first), second(r.model, r.second);
    const PhaseOutcome half = simulate_phase(first, {r.start, 0, kJoin});
    apart += half.rejected + simulate_phase(second, {half.end_state, kJoin, 1}).rejected;
    DormandPrince853<double> stepper(dynamics.manifold(), {1e-12, 1e-13, {}});
    const std::vector<double> y0 = dynamics.initial(r.start, 0);
    const IntegrationResult across = integrate(stepper, dynamics, 0, y0, 1);
    ASSERT_TRUE(across.finished());
    without += static_cast<long>(across.statistics.rejected);
  }
  std::printf("[ measured ] rejected steps of 10 robots: %ld with breaks, %ld as two phases, %ld without breaks\n",
              with, apart, without);
  EXPECT_LE(with, apart + 10);
  EXPECT_GT(without, 4 * with);
}

TEST(Breaks, Rk4RetainsItsOrder) {
  const Jumping r = jumping_robot(3, JointControl::prescribed);
  PhaseDynamics dynamics(r.model, r.whole);
  const State fine = simulate_phase(dynamics, {r.start, 0, 1}).end_state;
  const auto error = [&](double step) {
    IntegrationSetup setup;
    setup.method = IntegrationSetup::Method::rk4;
    setup.step = step;
    return difference(simulate_phase(dynamics, {r.start, 0, 1}, setup).end_state, fine);
  };
  // Neither step size divides 1/3. With the jump inside a step, the error would decrease by at most 16, not by 256.
  const double coarse = error(1.0 / 20), fine_step = error(1.0 / 80);
  std::printf("[ measured ] RK4 across a jump: %.3g, %.3g\n", coarse, fine_step);
  EXPECT_GT(coarse / fine_step, 100);
}

// Inertia times the acceleration on each side of the join.
TEST(Breaks, SampleAtBreakHasLaterLimit) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives.resize(1);
  setup.drives[0].control = JointControl::prescribed;
  setup.drives[0].trajectory =
      interpolate_samples(std::vector<double>{0, 1, 2}, std::vector<double>{0, 1, 0}, std::vector<double>{0, 0, 0});
  PhaseDynamics dynamics(model, setup);
  std::vector<double> times, efforts;
  const auto note = [&](const PhaseSample& s) { times.push_back(s.time), efforts.push_back(s.motor[0]); };
  simulate_phase(dynamics, {turning(model, 0), 0, 2, 0.5}, {}, {.observe = note});
  EXPECT_THAT(times, ElementsAre(0, 0.5, 1, 1.5, 2));
  EXPECT_NEAR(efforts[0], 6 * kWheelInertia, 1e-12);
  EXPECT_NEAR(efforts[2], -6 * kWheelInertia, 1e-12);  // both segments: decelerating, then accelerating back
  simulate_phase(dynamics, {turning(model, 0), 0, 1}, {}, {.observe = note});
  EXPECT_NEAR(efforts.back(), -6 * kWheelInertia, 1e-12);
  times.clear(), efforts.clear();
  setup.drives[0].trajectory =
      interpolate_samples(std::vector<double>{0, 1, 2}, std::vector<double>{0, 1, 1}, std::vector<double>{0, 0, 0});
  PhaseDynamics stops(model, setup);
  simulate_phase(stops, {turning(model, 0), 0, 2, 0.25}, {}, {.observe = note});
  EXPECT_EQ(times.size(), 9u);
  EXPECT_NEAR(efforts[4], 0, 1e-12);  // the next segment is at rest
  simulate_phase(stops, {turning(model, 0), 0, 1}, {}, {.observe = note});
  EXPECT_NEAR(efforts.back(), -6 * kWheelInertia, 1e-12);  // the previous segment decelerates
  efforts.clear();
  State end = turning(model, 0, 1);
  simulate_phase(stops, {end, 2, 0, 1}, {}, {.observe = note});  // backwards, at t = 2, 1, 0
  EXPECT_NEAR(efforts[1], -6 * kWheelInertia, 1e-12);
}

// x = F/m (dt^2/2 + dt (t - end)) after a push of length dt: a jump of the force does not reduce the accuracy.
TEST(Breaks, PushIsExact) {
  const Model model = one_body(Symmetric3d::diagonal(1, 1, 1));
  PhaseSetup setup;
  ExternalLoad load;
  load.amplitude.linear = {0, 6, 0};
  load.profile.start = kJoin, load.profile.end = 0.8;
  setup.loads = {load};
  PhaseDynamics dynamics(model, setup);
  EXPECT_THAT(dynamics.breaks(0, 2), ElementsAre(kJoin, 0.8));
  EXPECT_THAT(dynamics.breaks(2, 0), ElementsAre(0.8, kJoin));
  EXPECT_THAT(dynamics.breaks(kJoin, 0.8), ElementsAre());
  const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 2});
  const double dt = 0.8 - kJoin;
  EXPECT_NEAR(o.end_state.q[1], 2 * (dt * dt / 2 + dt * 1.2), 1e-14);
  EXPECT_NEAR(o.end_state.v[4], 2 * dt, 1e-14);
  EXPECT_EQ(o.rejected, 0);
}

TEST(Breaks, EqualUpToRoundingCountOnce) {
  const Model model = one_body(Symmetric3d::diagonal(1, 1, 1));
  ExternalLoad a, b;
  a.profile.start = 0.3, a.profile.end = 1;
  b.profile.start = 0.1 + 0.2, b.profile.end = 2;
  PhaseSetup setup;
  setup.loads = {a, b};
  EXPECT_THAT(PhaseDynamics(model, setup).breaks(0, 2), ElementsAre(0.3, 1));
}

// Ten thousand breaks with negligible jumps: about one step per break and few rejected steps.
TEST(Breaks, Many) {
  const Model model = flywheel({});
  std::vector<double> times, positions, rates;
  const int count = 10000;
  for (int k = 0; k <= count; ++k) {
    times.push_back(0.01 * k);
    positions.push_back(std::sin(times.back())), rates.push_back(std::cos(times.back()));
  }
  PhaseSetup setup;
  setup.drives.resize(1);
  setup.drives[0].control = JointControl::prescribed;
  setup.drives[0].trajectory = interpolate_samples(times, positions, rates);
  PhaseDynamics dynamics(model, setup);
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 1), 0, 100});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_LT(o.steps, count + 20);
  EXPECT_LT(o.rejected, 20);
  EXPECT_NEAR(o.integrals.motor_work, 0.5 * kWheelInertia * (std::cos(100) * std::cos(100) - 1), 1e-10);
}

TEST(Breaks, DoNotChangeDynamics) {
  const Jumping r = jumping_robot(1, JointControl::prescribed);
  PhaseDynamics used(r.model, r.whole), fresh(r.model, r.whole);
  simulate_phase(used, {r.start, 0, 0.2});
  const std::vector<double> y = fresh.initial(r.start, 0);
  used.initial(r.start, 0);
  EXPECT_EQ(difference(used.state(0.7, y), fresh.state(0.7, y)), 0);
}

}  // namespace breaks_test
}  // namespace grapnel::testing
