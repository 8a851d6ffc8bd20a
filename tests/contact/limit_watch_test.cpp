// Times at which joints exceed and re-enter their limits, against closed forms.
#include "grapnel/contact/motion_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "contact/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace limit_watch_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

// A free base and a joint with the limits.
Model joint_model(const JointLimits& limits) {
  return ModelBuilder()
      .add(body_on("base", "", JointType::free))
      .add(body_on("link", "base", JointType::revolute, limits))
      .build();
}

using Curve = std::function<double(double)>;

// The events of a joint that moves along position(t) with rate(t), sampled at equal intervals.
std::vector<LimitEvent> watch(const JointLimits& limits, const Curve& position, const Curve& rate, double end,
                              int intervals, const Curve& effort = {}, bool cut = false) {
  const Model model = joint_model(limits);
  LimitWatch w(cut);
  w.begin_phase("approach", model);
  for (int i = 0; i <= intervals; ++i) {
    const double t = end * i / intervals;
    State state = zero_state(model);
    state.q.back() = position(t), state.v.back() = rate(t);
    std::vector<double> efforts;
    if (effort) efforts.push_back(effort(t));
    w.sample(t, state, efforts);
  }
  w.end_phase();
  return w.events();
}

JointLimits position_limits(double lower, double upper) {
  JointLimits l;
  l.lower = lower, l.upper = upper;
  return l;
}

// q = sin t exceeds +-0.9 at asin 0.9 and re-enters at pi - asin 0.9.
TEST(LimitWatch, PositionsOfASine) {
  const std::vector<LimitEvent> events = watch(
      position_limits(-0.9, 0.9), [](double t) { return std::sin(t); }, [](double t) { return std::cos(t); }, 6.1, 61);
  ASSERT_THAT(events, SizeIs(2));
  const double t0 = std::asin(0.9);
  // Error of cubics over 0.1 s: h^4 / 384 times the fourth derivative, 2e-7; the rate there is 0.4.
  EXPECT_NEAR(events[0].begin_time, t0, 1e-6);  // measured 2.2e-7
  EXPECT_NEAR(events[0].end_time, M_PI - t0, 1e-6);
  EXPECT_NEAR(events[0].worst_value, 1, 1e-6);
  EXPECT_NEAR(events[0].worst_time, M_PI_2, 1e-5);
  EXPECT_EQ(events[0].limit, 0.9);
  EXPECT_EQ(events[0].kind, LimitKind::position);
  EXPECT_EQ(events[0].joint, "link_joint");
  EXPECT_EQ(events[0].phase, "approach");
  EXPECT_NEAR(events[1].begin_time, M_PI + t0, 1e-6);
  EXPECT_NEAR(events[1].worst_value, -1, 1e-6);
  EXPECT_EQ(events[1].limit, -0.9);
}

// A parabola, which cubics interpolate exactly, exceeds the limit only between two samples.
TEST(LimitWatch, ExcursionBetweenTwoSamples) {
  const std::vector<LimitEvent> events = watch(
      position_limits(-10, 0.99), [](double t) { return 1 - (t - 0.5) * (t - 0.5); },
      [](double t) { return 1 - 2 * t; }, 1, 1);
  ASSERT_THAT(events, SizeIs(1));
  EXPECT_NEAR(events[0].begin_time, 0.4, 1e-7);  // the tolerance of 1e-8 over the rate 0.2
  EXPECT_NEAR(events[0].end_time, 0.6, 1e-7);
  EXPECT_NEAR(events[0].worst_value, 1, 1e-14);
  EXPECT_NEAR(events[0].worst_time, 0.5, 1e-12);
}

TEST(LimitWatch, RatesOfACubic) {
  JointLimits l;
  l.rate = 1;
  // rate 3 t^2 - 3: from -3 to 9 in [0, 2].
  const std::vector<LimitEvent> events = watch(
      l, [](double t) { return t * t * t - 3 * t; }, [](double t) { return 3 * t * t - 3; }, 2, 5);
  ASSERT_THAT(events, SizeIs(2));
  EXPECT_EQ(events[0].kind, LimitKind::rate);
  EXPECT_EQ(events[0].begin_time, 0);
  EXPECT_NEAR(events[0].end_time, std::sqrt(2.0 / 3), 1e-8);
  EXPECT_EQ(events[0].worst_value, -3);
  EXPECT_EQ(events[0].limit, -1);
  EXPECT_NEAR(events[1].begin_time, std::sqrt(4.0 / 3), 1e-8);
  EXPECT_EQ(events[1].end_time, 2);
  EXPECT_EQ(events[1].worst_value, 9);
  EXPECT_EQ(events[1].limit, 1);
}

// Acceleration 2, coasting at the rate limit, deceleration to rest at the position limit, rest; samples are not at the
// breaks.
TEST(LimitWatch, MotionExactlyAtItsLimitsIsNoViolation) {
  JointLimits l = position_limits(0, 0.75);
  l.rate = 0.5, l.effort = 2;
  const auto acceleration = [](double t) { return t < 0.25 ? 2.0 : t < 1.5 ? 0.0 : t < 1.75 ? -2.0 : 0.0; };
  const auto rate = [](double t) { return t < 0.25 ? 2 * t : t < 1.5 ? 0.5 : t < 1.75 ? 0.5 - 2 * (t - 1.5) : 0.0; };
  const auto position = [](double t) {
    if (t < 0.25) return t * t;
    if (t < 1.5) return 0.0625 + 0.5 * (t - 0.25);
    return 0.75 - (t < 1.75 ? (1.75 - t) * (1.75 - t) : 0.0);
  };
  for (const int intervals : {2, 3, 7, 19, 50, 333, 1000}) {
    EXPECT_THAT(watch(l, position, rate, 2, intervals, acceleration), IsEmpty()) << intervals;
  }
  // The same motion with limits smaller by a millionth.
  l.upper *= 1 - 1e-6, l.rate *= 1 - 1e-6, l.effort *= 1 - 1e-6;
  const std::vector<LimitEvent> events = watch(l, position, rate, 2, 333, acceleration);
  ASSERT_THAT(events, SizeIs(4));  // effort, rate, effort, position
  EXPECT_EQ(events[0].kind, LimitKind::effort);
  EXPECT_EQ(events[1].kind, LimitKind::rate);
  EXPECT_EQ(events[2].kind, LimitKind::effort);
  EXPECT_EQ(events[2].limit, -l.effort);
  EXPECT_EQ(events[3].kind, LimitKind::position);
  EXPECT_EQ(events[3].end_time, 2);
}

TEST(LimitWatch, SaturatedEffortsAreSeparateEvents) {
  JointLimits l;
  l.effort = 3;
  const auto still = [](double) { return 0.0; };
  const auto effort = [](double t) { return std::clamp(2 * (t - 5), -3.0, 3.0); };
  EXPECT_THAT(watch(l, still, still, 10, 100, effort), IsEmpty());
  const std::vector<LimitEvent> events = watch(l, still, still, 10, 100, effort, true);
  ASSERT_THAT(events, SizeIs(2));
  for (const LimitEvent& e : events) EXPECT_EQ(e.kind, LimitKind::effort_saturated);
  EXPECT_EQ(events[0].begin_time, 0);
  EXPECT_NEAR(events[0].end_time, 3.5, 1e-12);
  EXPECT_EQ(events[0].worst_value, -3);
  EXPECT_EQ(events[0].limit, -3);
  EXPECT_NEAR(events[1].begin_time, 6.5, 1e-12);
  EXPECT_EQ(events[1].end_time, 10);
  // Beyond the limit it is a violation, with or without saturation.
  const std::vector<LimitEvent> beyond = watch(
      l, still, still, 10, 100, [](double t) { return 0.4 * t; }, true);
  ASSERT_THAT(beyond, SizeIs(2));
  EXPECT_EQ(beyond[0].kind, LimitKind::effort_saturated);
  EXPECT_EQ(beyond[1].kind, LimitKind::effort);
  EXPECT_NEAR(beyond[1].begin_time, 7.6, 1e-12);
  EXPECT_EQ(beyond[1].worst_value, 4);
}

TEST(LimitWatch, JointsWithoutLimitsHaveNoEvents) {
  EXPECT_THAT(
      watch(
          {}, [](double t) { return 1e6 * t; }, [](double) { return 1e6; }, 1, 10, [](double) { return 1e9; }, true),
      IsEmpty());
}

TEST(LimitWatch, RejectsInvalidArguments) {
  const Model model = joint_model({});
  LimitWatch w;
  EXPECT_THROW(w.sample(0, zero_state(model)), std::logic_error);
  EXPECT_THROW(w.end_phase(), std::logic_error);
  w.begin_phase("hold", model);
  EXPECT_THAT([&] { w.begin_phase("next", model); }, ThrowsMessage<std::logic_error>(HasSubstr("'hold'")));
  w.sample(1, zero_state(model));
  EXPECT_THAT([&] { w.sample(0.5, zero_state(model)); }, ThrowsMessage<std::invalid_argument>(HasSubstr("'hold'")));
  EXPECT_THROW(w.sample(2, zero_state(free_bodies(1))), std::invalid_argument);
  const std::vector<double> efforts{1, 2};
  EXPECT_THROW(w.sample(2, zero_state(model), efforts), std::invalid_argument);
}

// The events of a joint that moves along position(t) with rate(t) in these steps, each with a fresh start.
std::vector<LimitEvent> watch_steps(const JointLimits& limits, const Curve& position, const Curve& rate,
                                    const std::vector<double>& ends) {
  const Model model = joint_model(limits);
  LimitWatch w;
  w.begin_phase("approach", model);
  State state = zero_state(model);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    // Within a step, every kink is evaluated on the side that contains the middle of the step.
    const double middle = 0.5 * (ends[i] + ends[i + 1]);
    w.step(ends[i], ends[i + 1], true, [&](double t) -> const State& {
      const double inside = t + 1e-12 * (middle - t);
      state.q.back() = position(inside), state.v.back() = rate(inside);
      return state;
    });
    w.sample(ends[i], state);  // samples in a step come after it and contain efforts only
  }
  w.end_phase();
  return w.events();
}

// A joint stopped at its limit never exceeds it.
TEST(LimitWatch, JointStoppedAtItsLimitIsNoViolation) {
  const Curve position = [](double t) { return 0.9 - std::max(0.55 - t, 0.0); };
  const Curve rate = [](double t) { return t < 0.55 ? 1.0 : 0.0; };
  EXPECT_THAT(watch_steps(position_limits(-0.9, 0.9), position, rate, {0, 0.3, 0.55, 0.8, 1}), IsEmpty());
  EXPECT_THAT(watch(position_limits(-0.9, 0.85), position, rate, 1, 3), SizeIs(1));  // the watch is active
}

TEST(LimitWatch, ReversalsAndMaximumRatesInsideALongStep) {
  const Curve position = [](double t) { return std::sin(5 * t); };
  const Curve rate = [](double t) { return 5 * std::cos(5 * t); };
  const std::vector<LimitEvent> turns = watch_steps(position_limits(-2, 0.999), position, rate, {0, 0.6});
  ASSERT_THAT(turns, SizeIs(1));
  EXPECT_NEAR(turns[0].begin_time, std::asin(0.999) / 5, 1e-7);  // the threshold is 2e-9 beyond the limit
  EXPECT_NEAR(turns[0].end_time, (std::acos(-1.0) - std::asin(0.999)) / 5, 1e-7);
  EXPECT_NEAR(turns[0].worst_value, 1, 1e-12);
  JointLimits slow;
  slow.rate = 4.99;
  const std::vector<LimitEvent> rates = watch_steps(
      slow, [](double t) { return -std::cos(5 * t); }, [](double t) { return 5 * std::sin(5 * t); }, {0, 0.6});
  ASSERT_THAT(rates, SizeIs(1));
  EXPECT_NEAR(rates[0].begin_time, std::asin(0.998) / 5, 1e-7);
  EXPECT_NEAR(rates[0].worst_value, 5, 1e-9);
  EXPECT_THAT(watch_steps(position_limits(-2, 1.0001), position, rate, {0, 0.6}), IsEmpty());
}

}  // namespace limit_watch_test
}  // namespace grapnel
