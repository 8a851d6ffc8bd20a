/// Grasp points on one target that end-effectors cannot reach simultaneously: detection for any base pose, and the
/// reported gap.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/plan/reach_failure.hpp"
#include "plan/shared_target.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace arms_at_once_test {

using ::testing::HasSubstr;
using ::testing::Not;
using Orientation = Goal::Orientation;

// The thesis's arms (3 m each, mounts 1 m apart) and one target with points at x = +-distance/2.
ReachProblem thesis_pair(const Servicer& s, double distance) {
  ReachProblem p = thesis_problem(s, RateDemand::velocity);
  p.starts = 2;
  for (int i = 0; i < 2; ++i) {
    Goal& g = p.goals[i];
    g.target = "sat", g.point = i == 0 ? "right" : "left";
    g.X_WG = {Rotationd::identity(), {i == 0 ? 0.5 * distance : -0.5 * distance, 0.6, 0}};
    g.V_WG = Twistd::zero();
  }
  return p;
}

TEST(ArmsOnOneTarget, ReportsPointsTooFarApart) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  const ReachSolution r = plan_reach(base, thesis_pair(s, 7.4));
  EXPECT_FALSE(r.found);
  EXPECT_EQ(r.failure,
            "end-effectors 'tip-1' and 'tip-2' cannot reach grasp points 'right' and 'left' of target 'sat' "
            "simultaneously for any base pose: the grasp points are 7.4 m apart, the end-effectors come at most 7 m "
            "apart; a gap of 0.4 m remains between 'tip-2' and 'left' when 'tip-1' is at 'right'");
}

TEST(ArmsOnOneTarget, ReportsPointsTooClose) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_pair(s, 6.5);
  // All joints are fixed except the last, which moves by half a radian.
  p.lower = p.upper = {0, 0, 0, M_PI, 0, 0};
  p.upper[5] = 0.5;
  p.start.position = p.guess = p.lower;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  const double nearest = std::hypot(6 + std::cos(0.5), std::sin(0.5));
  char text[200];
  std::snprintf(
      text, sizeof text,
      "the grasp points are 6.5 m apart, the end-effectors come no nearer than %.4g m to each other; a gap of %.4g m",
      nearest, nearest - 6.5);
  EXPECT_THAT(r.failure, HasSubstr(text));
  EXPECT_THAT(r.failure, Not(HasSubstr("comes no closer")));
}

// The grasp points are along x; one end-effector must point along y, the other along z. No plane of both arms contains
// all three.
TEST(ArmsOnOneTarget, ReportsIncompatibleOrientations) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_pair(s, 2);
  for (Goal& g : p.goals) g.orientation = Orientation::axis, g.axis_E = {1, 0, 0};
  p.goals[0].direction_W = {0, 1, 0}, p.goals[1].direction_W = {0, 0, 1};
  const std::vector<Incompatible> found = incompatible_goals(base, p, p.guess);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].goals, (std::vector<std::size_t>{0, 1}));
  EXPECT_THAT(found[0].text, HasSubstr("with the demanded orientations for any base pose; without these they can"));
  // Both end-effectors share the gap.
  const ClosestTogether closest = closest_together(base, p, p.goals, p.guess);
  EXPECT_NEAR(closest.error.segment<2>(3).norm() + closest.error.segment<2>(8).norm(), M_PI / 2, 1e-4);
  EXPECT_LT(closest.error.head<3>().norm(), 1e-4);
  // Here the base's tilt puts the arms into the x-z plane.
  p.goals[0].direction_W = {-1, 0, 0};
  EXPECT_TRUE(incompatible_goals(base, p, p.guess).empty());
}

// A base with one end-effector, and a boom hinged on it with an end-effector at either end.
Servicer boom() {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 200;
  base.inertia = Symmetric3d::diagonal(30, 30, 30);
  BodyDescription b = base;
  b.name = "boom", b.parent = "base", b.joint.name = "boom-joint", b.joint.type = JointType::revolute;
  b.mass = 20, b.inertia = Symmetric3d::diagonal(5, 1, 5);
  builder.add(base).add(b);
  builder.add(FrameDescription{"nose", "base", {Rotationd::identity(), {1, 0, 0}}});
  builder.add(FrameDescription{"up", "boom", {Rotationd::identity(), {0, 1, 0}}});
  builder.add(FrameDescription{"down", "boom", {Rotationd::identity(), {0, -1, 0}}});
  Servicer s{builder.build(), {}};
  s.state = zero_state(s.model);
  return s;
}

ReachProblem boom_problem(const Servicer& s, const std::vector<std::pair<std::string, Vector3d>>& places) {
  ReachProblem p = reach_problem(s, 20, JointProfile::quintic, {0, 0, 0});
  p.demand = RateDemand::given;
  for (const auto& [name, place] : places) {
    Goal g;
    g.name = name, g.frame = s.model.frame_index(name);
    g.target = "sat", g.point = "for-" + name;
    g.X_WG.p = place;
    p.goals.push_back(g);
  }
  return p;
}

// nose to up rotates the boom in one direction, nose to down in the other.
TEST(ArmsOnOneTarget, ReportsThreeIncompatiblePointsWithCompatiblePairs) {
  const Servicer s = boom();
  FloatingBase base(s.model, true);
  const double d = std::sqrt(1.9 * 1.9 - 1);
  ReachProblem p = boom_problem(s, {{"nose", {d, 0, 0}}, {"up", {0, 1, 0}}, {"down", {0, -1, 0}}});
  const std::vector<Incompatible> found = incompatible_goals(base, p, p.guess);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].goals.size(), 3u);
  EXPECT_THAT(found[0].text, HasSubstr("end-effectors 'nose', 'up' and 'down' cannot reach grasp points 'for-nose', "
                                       "'for-up' and 'for-down' of target 'sat' simultaneously for any base pose, "
                                       "although each pair of them can: the closest attempt leaves 'nose'"));
  p.goals[0].X_WG.p = {1, 0, 0};
  EXPECT_TRUE(incompatible_goals(base, p, p.guess).empty());
  // Different targets do not constrain each other here.
  p.goals[0].X_WG.p = {d, 0, 0};
  p.goals[0].target = "other";
  EXPECT_TRUE(incompatible_goals(base, p, p.guess).empty());
}

// Grasp points without a common target, for end-effectors on one joint.
TEST(ArmsOnOneTarget, NamesTheSharedJoint) {
  const Servicer s = boom();
  FloatingBase base(s.model, false);
  const double a = 0.3;
  ReachProblem p = boom_problem(s, {{"up", {-std::sin(a), std::cos(a), 0}}, {"down", {-std::sin(a), -std::cos(a), 0}}});
  for (Goal& g : p.goals) g.target.clear(), g.point.clear();
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  EXPECT_THAT(r.failure, HasSubstr("end-effector 'up' comes no closer than"));
  EXPECT_THAT(r.failure,
              HasSubstr("it could arrive alone, but then 'down' could not: they share joints ('boom-joint')"));
  EXPECT_THAT(r.failure, HasSubstr("it could arrive alone, but then 'up' could not"));
}

// Compatible but unreachable points: the message names the end-effector and its point.
TEST(ArmsOnOneTarget, NamesTheUnreachablePoint) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_pair(s, 2);
  for (Goal& g : p.goals) g.X_WG.p[0] += 2.5;
  const ReachSolution r = plan_reach(base, p);
  EXPECT_FALSE(r.found);
  EXPECT_THAT(r.failure, HasSubstr("to grasp point 'right' of target 'sat': the grasp point is "));
  EXPECT_THAT(r.failure, HasSubstr("and the arm is at most 3 m long"));
  EXPECT_THAT(r.failure, Not(HasSubstr("simultaneously")));
}

// Reachable points, but not at the demanded speed.
TEST(ArmsOnOneTarget, ReportsTheNumberOfInitialGuesses) {
  const Servicer s = thesis_servicer();
  FloatingBase base(s.model, true);
  ReachProblem p = thesis_pair(s, 1);
  for (Goal& g : p.goals) g.V_WG.linear = {0, 60, 0};
  for (int starts : {1, 2, 5}) {
    p.starts = starts;
    const ReachSolution r = plan_reach(base, p);
    EXPECT_FALSE(r.found);
    EXPECT_EQ(r.starts, starts);
    EXPECT_THAT(r.failure,
                HasSubstr("each arm alone reaches its grasp point, but none of the " + std::to_string(starts) +
                          (starts == 1 ? " initial guess tried" : " initial guesses tried")));
  }
}

// Two planar arms can be as far apart as their lengths allow, and no farther.
TEST(RandomPair, GapAgreesWithTheChainLength) {
  Worst worst("gap against lengths [m]");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Servicer s = random_servicer_with({.arms = 2, .planar = true}, i);
    FloatingBase base(s.model, true);
    base.place(std::vector<double>(s.model.joints().size(), 0.0));
    double longest = 0;
    Vector3d mount[2];
    for (int a = 0; a < 2; ++a) {
      const std::string arm = std::to_string(a + 1);
      mount[a] = s.model.bodies()[s.model.body_index(arm + "-link-1")].description.X_PF.p;
      longest += norm(base.frame_pose(s.model.frame_index("hand-" + arm)).p - mount[a]);
    }
    longest += norm(mount[1] - mount[0]);
    ReachProblem p = reach_problem(s, 20, JointProfile::quintic, {0, 0, 0});
    for (int a = 0; a < 2; ++a) {
      Goal g;
      g.name = "hand-" + std::to_string(a + 1), g.frame = s.model.frame_index(g.name);
      g.target = "sat", g.point = "p" + std::to_string(a);
      p.goals.push_back(g);
    }
    Random random(900 + i);
    const Vector3d direction = random.direction();
    const double gap = random.uniform(0.01, 2);
    p.goals[1].X_WG.p = (longest + gap) * direction;
    const ClosestTogether closest = closest_together(base, p, p.goals, p.guess);
    const double left = (closest.error.segment<3>(3) - closest.error.head<3>()).norm();
    EXPECT_NEAR(worst.note(std::abs(left - gap), i), 0, 1e-6);  // measured 2e-9
    EXPECT_EQ(incompatible_goals(base, p, p.guess).size(), 1u);
    p.goals[1].X_WG.p = (longest - 0.01) * direction;
    EXPECT_TRUE(incompatible_goals(base, p, p.guess).empty());
  }
}

}  // namespace arms_at_once_test
}  // namespace grapnel::testing
