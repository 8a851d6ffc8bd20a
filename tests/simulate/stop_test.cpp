/// Phases that end when a condition decreases to zero.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace stop_test {

using ::testing::ElementsAre;

struct Stopped {
  PhaseOutcome outcome;
  std::vector<double> times;
};
Stopped run_until(PhaseDynamics& dynamics, const State& start, double t0, double t1, double interval,
                  const StopCondition& stop, const IntegrationSetup& integration = {}) {
  Stopped s;
  s.outcome =
      simulate_phase(dynamics, {start, t0, t1, interval}, integration,
                     {.observe = [&](const PhaseSample& sample) { s.times.push_back(sample.time); }, .stop = stop});
  return s;
}

StopCondition angle_below(double limit) {
  return [limit](double, const State& s) { return limit - s.q[0]; };
}

// The damped oscillator passes its reference for the first time at w t = pi - atan(w/damping).
TEST(Stop, MatchesClosedForm) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives = {{JointControl::pd, JointTrajectory::at_rest(1), 20, 2}};
  PhaseDynamics dynamics(model, setup);
  const double damping = 1 / kWheelInertia, w = std::sqrt(20 / kWheelInertia - damping * damping);
  const double expected = (M_PI - std::atan(w / damping)) / w;
  const Stopped s = run_until(dynamics, turning(model, 0), 0, 6, 0.25, angle_below(1));
  EXPECT_TRUE(s.outcome.stopped);
  EXPECT_TRUE(s.outcome.finished);
  EXPECT_NEAR(s.outcome.end_time, expected, 1e-12);  // measured 1.2e-14
  std::printf("[ measured ] stop of the damped oscillator: off by %.3g\n", std::abs(s.outcome.end_time - expected));
  EXPECT_NEAR(s.outcome.end_state.q[0], 1, 1e-12);
  EXPECT_THAT(s.times, ElementsAre(0, 0.25, 0.5, s.outcome.end_time));
  EXPECT_LE(s.outcome.integrals.external_work, 0);
}

// The state at the stop equals that of a phase with the same end time.
TEST(Stop, StateEqualsPhaseOfSameLength) {
  Worst worst("state at the stop against a phase of that length");
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 4, options.max_bodies = 8;
    const Model model = random_model(options, random);
    const State start = random_state(model, random, 0.5);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, JointControl::pd, 2, random);
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome s =
        simulate_phase(dynamics, {start, 0, 2}, {}, {.stop = [](double t, const State&) { return 1.2345 - t * t; }});
    ASSERT_TRUE(s.stopped);
    EXPECT_NEAR(s.end_time, std::sqrt(1.2345), 1e-13);
    const PhaseOutcome p = simulate_phase(dynamics, {start, 0, s.end_time});
    EXPECT_LT(worst.note(difference(s.end_state, p.end_state), i), 1e-10);
    EXPECT_NEAR(s.integrals.motor_work, p.integrals.motor_work, 1e-10);
  }
}

TEST(Stop, ImmediateIfNotPositive) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, {});
  for (double limit : {0.5, 0.3}) {  // zero, negative
    const Stopped s = run_until(dynamics, turning(model, 1, 0.5), 2, 5, 0.5, angle_below(limit));
    EXPECT_TRUE(s.outcome.stopped);
    EXPECT_TRUE(s.outcome.finished);
    EXPECT_EQ(s.outcome.end_time, 2);
    EXPECT_EQ(s.outcome.end_state.q[0], 0.5);
    EXPECT_EQ(s.outcome.steps, 0);
    EXPECT_THAT(s.times, ElementsAre(2));
  }
}

TEST(Stop, NeverEqualsPhaseWithout) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, {});
  const Stopped s = run_until(dynamics, turning(model, 1), 0, 2, 0.5, angle_below(3));
  EXPECT_FALSE(s.outcome.stopped);
  EXPECT_TRUE(s.outcome.finished);
  EXPECT_EQ(s.outcome.end_time, 2);
  EXPECT_THAT(s.times, ElementsAre(0, 0.5, 1, 1.5, 2));
  // A condition may increase first; the stop is at its decrease to zero.
  const auto window = [](double t, const State&) { return t < 1 ? 0.5 + t : 4 - 2.5 * t; };
  EXPECT_NEAR(run_until(dynamics, turning(model, 1), 0, 2, 0, window).outcome.end_time, 1.6, 1e-13);
}

TEST(Stop, OnAnOutputTimeYieldsOneSample) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, {});
  for (double end : {1.0, 5.0}) {
    const Stopped s = run_until(dynamics, turning(model, 1), 0, end, 0.25, angle_below(1));
    EXPECT_TRUE(s.outcome.stopped);
    EXPECT_NEAR(s.outcome.end_time, 1, 1e-13);
    ASSERT_GE(s.times.size(), 5u);
    EXPECT_EQ(s.times.back(), s.outcome.end_time);
    for (std::size_t k = 1; k < s.times.size(); ++k) EXPECT_GT(s.times[k], s.times[k - 1]);
  }
}

TEST(Stop, BackwardsAndWithRk4) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, {});
  const Stopped back = run_until(dynamics, turning(model, -2), 3, 0, 0.4, angle_below(1));
  EXPECT_TRUE(back.outcome.stopped);
  EXPECT_NEAR(back.outcome.end_time, 2.5, 1e-13);
  EXPECT_THAT(back.times, ElementsAre(3, 2.6, back.outcome.end_time));
  IntegrationSetup rk4;
  rk4.method = IntegrationSetup::Method::rk4;
  rk4.step = 0.03;
  EXPECT_NEAR(run_until(dynamics, turning(model, 2), 0, 3, 0.1, angle_below(1), rk4).outcome.end_time, 0.5, 1e-12);
}

// Past a break: rest until t = 1, then the parabola 0.5 (t - 1)^2, which is 0.32 at 1.8.
TEST(Stop, FoundAfterBreak) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives.resize(1);
  setup.drives[0].control = JointControl::prescribed;
  setup.drives[0].trajectory.segments = {{0, 1, ChebyshevSegment{{0}}},
                                         {1, 3, ChebyshevSegment{{0.75, 1, 0.25}}}};  // 0.5 (x + 1)^2
  PhaseDynamics dynamics(model, setup);
  const Stopped s = run_until(dynamics, turning(model, 0), 0, 3, 0.5, angle_below(0.32));
  EXPECT_TRUE(s.outcome.stopped);
  EXPECT_NEAR(s.outcome.end_time, 1.8, 1e-12);
  EXPECT_NEAR(s.outcome.end_state.v[0], 0.8, 1e-12);
  EXPECT_THAT(s.times, ElementsAre(0, 0.5, 1, 1.5, s.outcome.end_time));
  // A condition that reaches zero exactly at the break.
  const auto until_one = [](double t, const State&) { return 1 - t; };
  const Stopped at_break = run_until(dynamics, turning(model, 0), 0, 3, 0.5, until_one);
  EXPECT_EQ(at_break.outcome.end_time, 1);
  EXPECT_THAT(at_break.times, ElementsAre(0, 0.5, 1));
}

TEST(Stop, RejectsNaN) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, {});
  EXPECT_THROW(run_until(dynamics, turning(model, 1), 0, 1, 0, [](double, const State&) { return NAN; }),
               std::domain_error);
}

}  // namespace stop_test
}  // namespace grapnel::testing
