// Minimum clearances and events between samples, against closed forms.
#include "grapnel/contact/motion_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "contact/random_shape.hpp"
#include "contact/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace clearance_watch_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

Geometry ball(double radius) { return {Shape::sphere, {radius, 0, 0}, Posed::identity()}; }

// Watches steady motions of free bodies at equal intervals.
ClearanceWatch watch(const Model& model, const ClearanceModel& clearance, const std::vector<SteadyBody>& bodies,
                     double required, double begin, double end, int intervals) {
  ClearanceWatch result(required);
  result.begin_phase("approach", model, clearance);
  for (int i = 0; i <= intervals; ++i) {
    const double t = begin + (end - begin) * i / intervals;
    result.sample(t, steady_state(model, bodies, t));
  }
  result.end_phase();
  return result;
}

// Distance of centres^2 = miss^2 + speed^2 (t - t_c)^2.
TEST(ClearanceWatch, FindsPassageBetweenSamples) {
  Random random(31);
  const Model model = free_bodies(2);
  const ClearanceModel clearance(model, {{0, ball(0.3)}, {1, ball(0.2)}});
  Worst distance("minimum distance [m]"), time("its time [s]"), crossing("begin and end of the event [s]");
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double miss = random.uniform(0.1, 2), speed = random.log_uniform(0.05, 5);
    const Vector3d n = random.direction(), common = random.vector(1);
    Vector3d v = cross(n, random.direction());
    v *= speed / norm(v);
    const double t_c = random.uniform(1, 9), minimum = miss - 0.5, required = minimum + random.uniform(0.01, 0.3);
    const std::vector<SteadyBody> bodies = {{random.vector(5), common, 0.3}, {{}, common + v, -0.2}};
    std::vector<SteadyBody> placed = bodies;
    placed[1].p = bodies[0].p + miss * n - t_c * v;
    const ClearanceWatch found = watch(model, clearance, placed, required, 0, 10, 9);
    const MinimumClearance& l = found.minima().at(0);
    ASSERT_LT(distance.note(std::abs(l.distance - minimum), i), 1e-9);  // measured 2.4e-15
    ASSERT_LT(time.note(std::abs(l.time - t_c), i), 1e-5);              // measured 8e-7
    EXPECT_EQ(l.body_a, "a");
    EXPECT_EQ(l.body_b, "b");
    EXPECT_EQ(l.phase, "approach");
    EXPECT_LT(norm(l.point_a - (placed[0].p + t_c * common + 0.3 * n)), 1e-4);

    const double half = std::sqrt(std::pow(required + 0.5, 2) - miss * miss) / speed;
    const std::vector<ClearanceEvent> events = found.events();
    ASSERT_THAT(events, SizeIs(1));
    const double begin = std::max(0.0, t_c - half), end = std::min(10.0, t_c + half);
    ASSERT_LT(crossing.note(std::abs(events[0].begin_time - begin), i), 1e-8);  // measured 1.3e-13
    ASSERT_LT(crossing.note(std::abs(events[0].end_time - end), i), 1e-8);
    EXPECT_NEAR(events[0].minimum.distance, minimum, 1e-9);
    EXPECT_EQ(events[0].required, required);
    EXPECT_EQ(events[0].phase, "approach");
  }
}

// A pair that is never the closest at samples but dips in between, while another pair stays closer at the samples.
TEST(ClearanceWatch, FindsPairsThatAreNotClosestAtSamples) {
  const Model model = free_bodies(4);
  const ClearanceModel clearance(model, {{0, ball(0.1)}, {1, ball(0.1)}, {2, ball(0.1)}, {3, ball(0.1)}});
  const std::vector<SteadyBody> bodies = {
      {{0, 0, 0}, {}}, {{0.5, 0, 0}, {}}, {{-2, 10, 0}, {4, 0, 0}}, {{0, 10.25, 0}, {}}};
  const ClearanceWatch found = watch(model, clearance, bodies, 0.1, 0, 1, 1);
  EXPECT_NEAR(found.minima()[0].distance, 0.05, 1e-9);
  EXPECT_NEAR(found.minima()[0].time, 0.5, 1e-6);
  EXPECT_EQ(found.minima()[0].body_a + found.minima()[0].body_b, "cd");
  ASSERT_THAT(found.events(), SizeIs(1));
  EXPECT_NEAR(found.events()[0].begin_time, 0.5 - std::sqrt(0.3 * 0.3 - 0.0625) / 4, 1e-9);
}

// The event and the overlap begin at different times.
TEST(ClearanceWatch, OverlapBeginsAfterTheEvent) {
  const Model model = free_bodies(2);
  const ClearanceModel clearance(model, {{0, ball(0.5)}, {1, ball(0.5)}});
  // Approaching at 1 m/s: 0.4 m apart at t = 1.6 s, touching at 2 s, separating afterwards.
  const std::vector<SteadyBody> bodies = {{{0, 0, 0}, {}}, {{3, 0, 0}, {-1, 0, 0}}};
  for (const double required : {0.0, 0.4}) {
    for (const int intervals : {1, 3, 50}) {
      const ClearanceWatch found = watch(model, clearance, bodies, required, 0, 2.7, intervals);
      ASSERT_THAT(found.events(), SizeIs(1));
      EXPECT_NEAR(found.events()[0].begin_time, 2 - required, 1e-12);  // measured 4e-16
      ASSERT_TRUE(found.events()[0].overlap_begin);
      EXPECT_NEAR(*found.events()[0].overlap_begin, 2, 1e-12);  // measured 4e-16
    }
  }
  const ClearanceWatch apart = watch(model, clearance, bodies, 0.4, 0, 1.9, 7);
  ASSERT_THAT(apart.events(), SizeIs(1));
  EXPECT_FALSE(apart.events()[0].overlap_begin);
  // From the first sample on.
  const ClearanceWatch within = watch(model, clearance, bodies, 0.4, 2.5, 2.7, 2);
  EXPECT_EQ(within.events().at(0).overlap_begin, 2.5);
}

// The far tip of a thin rod that rotates about one of its points passes a ball.
TEST(ClearanceWatch, RotatingRodPassesABall) {
  Random random(32);
  const Model model = free_bodies(2);
  Geometry rod{Shape::capsule, {0.002, 4, 0}, {rotation_about({0, 1, 0}, M_PI_2), {1, 0, 0}}};
  const ClearanceModel clearance(model, {{0, rod}, {1, ball(0.05)}});
  Worst distance("minimum distance of a turning rod [m]"), time("its time [s]");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double t_c = random.uniform(0.4, 0.8), gap = random.uniform(0.01, 0.5);
    // Half of them near half a turn, where quaternions of samples change their signs.
    const double w = i % 2 == 0 ? random.uniform(0.5, 2) : M_PI / t_c + random.uniform(-0.01, 0.01);
    const double angle = w * t_c, reach = 3 + 0.002 + 0.05 + gap;
    const std::vector<SteadyBody> bodies = {{{}, {}, w}, {{reach * std::cos(angle), reach * std::sin(angle), 0}, {}}};
    // Turns of up to 0.1 rad between samples.
    const ClearanceWatch found = watch(model, clearance, bodies, 0, 0, 1.2, 97);
    ASSERT_LT(distance.note(std::abs(found.minima()[0].distance - gap), i), 1e-8);  // measured 1.8e-15
    ASSERT_LT(time.note(std::abs(found.minima()[0].time - t_c), i), 1e-5);          // measured 1.2e-8
  }
}

// Two bodies are too close from the first violation of any of their shapes to the last one, for any pairs of shapes.
TEST(ClearanceWatch, MergesEventsOfBodies) {
  const auto ball_at = [](double x) {
    return Geometry{Shape::sphere, {0.1, 0, 0}, {Rotationd::identity(), {x, 0, 0}}};
  };
  const Model model = free_bodies(2);
  // Balls of body a at x = 0, 0.3 and 2. A ball of b starts at x = 3, moves at 1 m/s along -x, and is closer than 0.1 m
  // to each of them while their centres are less than 0.3 m apart.
  const ClearanceModel clearance(model, {{0, ball_at(0)}, {1, ball_at(0)}, {0, ball_at(0.3)}, {0, ball_at(2)}});
  const std::vector<SteadyBody> bodies = {{{0, 0, 0}, {}}, {{3, 0, 0}, {-1, 0, 0}}};
  const ClearanceWatch found = watch(model, clearance, bodies, 0.1, 0, 4, 80);
  const std::vector<ClearanceEvent> events = found.events();
  ASSERT_THAT(events, SizeIs(2));
  EXPECT_NEAR(events[0].begin_time, 0.7, 1e-12);
  EXPECT_NEAR(events[0].end_time, 1.3, 1e-12);
  EXPECT_NEAR(events[1].begin_time, 2.4, 1e-12);
  EXPECT_NEAR(events[1].end_time, 3.3, 1e-12);
  EXPECT_NEAR(events[1].overlap_begin.value(), 2.5, 1e-12);
  EXPECT_NEAR(events[1].minimum.distance, -0.2, 1e-6);
  EXPECT_NEAR(found.minima()[0].distance, -0.2, 1e-6);
}

TEST(ClearanceWatch, PhasesAreSeparate) {
  const Model model = free_bodies(2);
  const ClearanceModel balls(model, {{0, ball(0.5)}, {1, ball(0.5)}}), none;
  const std::vector<SteadyBody> bodies = {{{0, 0, 0}, {}}, {{3, 0, 0}, {-1, 0, 0}}};
  ClearanceWatch w(0.5);
  w.begin_phase("first", model, balls);
  for (const double t : {0.0, 1.0, 2.0}) w.sample(t, steady_state(model, bodies, t));
  w.end_phase();
  w.begin_phase("second", model, balls);
  EXPECT_NEAR(w.sample(2.0, steady_state(model, bodies, 2)).distance, 0, 1e-15);
  w.sample(2.5, steady_state(model, bodies, 2.5));
  w.end_phase();
  w.begin_phase("third", model, none);
  w.sample(2.5, steady_state(model, bodies, 2.5));
  w.end_phase();
  ASSERT_THAT(w.minima(), SizeIs(3));
  EXPECT_NEAR(w.minima()[0].distance, 0, 1e-15);
  EXPECT_NEAR(w.minima()[1].distance, -0.5, 1e-15);
  EXPECT_EQ(w.minima()[2].distance, INFINITY);
  EXPECT_EQ(w.minima()[2].phase, "third");
  const std::vector<ClearanceEvent> events = w.events();
  ASSERT_THAT(events, SizeIs(2));
  EXPECT_NEAR(events[0].begin_time, 1.5, 1e-12);
  EXPECT_EQ(events[0].end_time, 2);
  EXPECT_EQ(events[1].begin_time, 2);
  EXPECT_EQ(events[1].end_time, 2.5);
  EXPECT_EQ(events[1].phase, "second");
}

// Two balls of radius 0.5 along x, the second at these distances of the centres at t = 0, 1, ...; the pair has touched.
ClearanceWatch watch_parting(const Model& model, const ClearanceModel& balls, const std::vector<double>& distances,
                             double required) {
  const int parting[] = {0};
  ClearanceWatch w(required);
  w.begin_phase("after", model, balls, parting);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double ahead = i + 1 < distances.size() ? distances[i + 1] - distances[i] : 0;
    State state = steady_state(model, {{{0, 0, 0}, {}}, {{distances[i], 0, 0}, {ahead, 0, 0}}}, 0);
    w.sample(static_cast<double>(i), state);
  }
  w.end_phase();
  return w;
}

TEST(ClearanceWatch, PartingPairMakesNoEvent) {
  const Model model = free_bodies(2);
  const ClearanceModel balls(model, {{0, ball(0.5)}, {1, ball(0.5)}});
  for (const double start : {1.0, 1 - 1e-12, 0.95, 0.7}) {
    SCOPED_TRACE(start);
    const ClearanceWatch w = watch_parting(model, balls, {start, start, 1.001, 1.03, 1.2}, 0.1);
    EXPECT_THAT(w.events(), SizeIs(0));
    EXPECT_NEAR(w.minima()[0].distance, 0.2, 1e-12);  // the pair is monitored again after its separation
  }
  // A pair that stays in contact within a millimetre causes no event either.
  const ClearanceWatch w = watch_parting(model, balls, {0.95, 0.9495, 0.9502, 0.95}, 0);
  EXPECT_THAT(w.events(), SizeIs(0));
  EXPECT_EQ(w.minima()[0].distance, INFINITY);
}

TEST(ClearanceWatch, ReturningPairMakesAnEvent) {
  const Model model = free_bodies(2);
  const ClearanceModel balls(model, {{0, ball(0.5)}, {1, ball(0.5)}});
  // From contact to penetration.
  ClearanceWatch w = watch_parting(model, balls, {1, 0.9, 0.861, 0.861}, 0.02);
  ASSERT_THAT(w.events(), SizeIs(1));
  EXPECT_NEAR(w.events()[0].minimum.distance, -0.139, 1e-6);
  EXPECT_NEAR(w.events()[0].overlap_begin.value(), 0, 1e-3);
  EXPECT_EQ(w.minima()[0].distance, w.events()[0].minimum.distance);
  // From a designed overlap to a deeper one.
  w = watch_parting(model, balls, {0.9, 0.95, 0.85}, 0);
  ASSERT_THAT(w.events(), SizeIs(1));
  EXPECT_NEAR(w.events()[0].minimum.distance, -0.15, 1e-9);
  // After separation the pair is treated like any other.
  w = watch_parting(model, balls, {0.9, 1.3, 1.05}, 0.1);
  ASSERT_THAT(w.events(), SizeIs(1));
  EXPECT_NEAR(w.events()[0].minimum.distance, 0.05, 1e-9);
  EXPECT_FALSE(w.events()[0].overlap_begin.has_value());
}

// The maximum distance carries over to the next phase, unless the pair is held in between.
TEST(ClearanceWatch, PartingContinuesAcrossPhases) {
  const Model model = free_bodies(2);
  const ClearanceModel balls(model, {{0, ball(0.5)}, {1, ball(0.5)}}), none;
  const auto at = [&](double distance) { return steady_state(model, {{{0, 0, 0}, {}}, {{distance, 0, 0}, {}}}, 0); };
  const int parting[] = {0};
  for (const bool held : {false, true}) {
    SCOPED_TRACE(held);
    ClearanceWatch w(0.1);
    w.begin_phase("first", model, balls, parting);
    w.sample(0, at(0.9)), w.sample(1, at(1.5));
    w.end_phase();
    w.begin_phase("between", model, held ? none : balls, held ? std::span<const int>() : parting);
    w.sample(1, at(1.5)), w.sample(2, at(1.5));
    w.forget_phase();
    w.begin_phase("between", model, held ? none : balls, held ? std::span<const int>() : parting);
    w.sample(1, at(1.5)), w.sample(2, at(1.5));
    w.end_phase();
    w.begin_phase("last", model, balls, parting);
    w.sample(2, at(0.95)), w.sample(3, at(0.95));
    w.end_phase();
    EXPECT_THAT(w.events(), SizeIs(held ? 0 : 1));
  }
}

TEST(ClearanceWatch, RejectsInvalidArguments) {
  const Model model = free_bodies(2);
  const ClearanceModel clearance(model, {{0, ball(0.5)}, {1, ball(0.5)}});
  EXPECT_THROW(ClearanceWatch{NAN}, std::invalid_argument);
  ClearanceWatch w;
  EXPECT_THROW(w.sample(0, zero_state(model)), std::logic_error);
  EXPECT_THROW(w.end_phase(), std::logic_error);
  w.begin_phase("hold", model, clearance);
  EXPECT_THAT([&] { w.begin_phase("next", model, clearance); }, ThrowsMessage<std::logic_error>(HasSubstr("'hold'")));
  w.sample(1, zero_state(model));
  EXPECT_THAT([&] { w.sample(0.5, zero_state(model)); }, ThrowsMessage<std::invalid_argument>(HasSubstr("'hold'")));
  EXPECT_THROW(w.sample(2, zero_state(free_bodies(1))), std::invalid_argument);
}

}  // namespace clearance_watch_test
}  // namespace grapnel
