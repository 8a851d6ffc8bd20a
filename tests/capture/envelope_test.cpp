/// Capture envelopes: closed grasps, missed grasps, captures at the envelope. Clearance and joint limits, against
/// closed forms.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numbers>
#include <set>

#include "capture/recorded.hpp"

namespace grapnel::testing {
namespace envelope_test {

using ::testing::HasSubstr;
using Orientation = GraspSetup::Orientation;

// Case 1 with a motion afterwards; both end-effectors deviate by centimetres and move relative to their targets.
CaptureProblem grasping() {
  CaptureProblem p = thesis_case_pd();
  p.approach->duration = 10;
  p.targets[0].V_WT = {{0.05, -0.02, 0.2}, {0.01, 0.02, -0.01}};
  p.post_impact.emplace();
  p.post_impact->duration = 5;
  p.output_interval = 0.25;
  for (EndEffectorSetup& e : p.robot.end_effectors) e.approach_axis = Vector3d{1, 0, 0};
  for (TargetSetup& t : p.targets) {
    t.grasp_points[0].approach_direction = Vector3d{0, 1, 0};
    t.grasp_points[0].X_TG.R = rotation_about({0.6, 0, 0.8}, 0.4);
  }
  return p;
}

TEST(Envelope, EachCriterionFailsAloneWithItsNumbers) {
  for (Orientation o : {Orientation::free, Orientation::axis, Orientation::pose}) {
    CaptureProblem p = grasping();
    for (GraspSetup& g : p.grasps) g.orientation = o;
    const CaptureResult open = simulate_capture(p);
    ASSERT_EQ(open.status, CaptureStatus::completed) << open.failure;
    ASSERT_TRUE(open.captured());
    EXPECT_THAT(open.grasps[0].reason, HasSubstr("no envelope"));
    const GraspError m = grasp_error(p, open, 0, last_sample(open, "approach"));
    const double angle = o == Orientation::free ? 0 : o == Orientation::axis ? m.axis_angle() : m.pose_angle();
    const double found[] = {m.distance(), angle, norm(m.relative_velocity()), norm(m.relative_spin())};
    const char* names[] = {"distance", "angle", "speed", "angular rate"};
    EXPECT_NEAR(open.grasps[0].distance, found[0], 1e-12);
    EXPECT_NEAR(open.grasps[0].angle, found[1], 1e-9);
    EXPECT_NEAR(open.grasps[0].velocity, found[2], 1e-12);
    EXPECT_NEAR(open.grasps[0].angular_velocity, found[3], 1e-12);
    for (int tight = -1; tight < 4; ++tight) {
      if (tight == 1 && o == Orientation::free) continue;
      CaptureProblem q = p;
      CaptureEnvelope e;
      double* const tolerances[] = {&e.position, &e.angle, &e.velocity, &e.angular_velocity};
      for (int c = 0; c < 4; ++c) *tolerances[c] = found[c] * (c == tight ? 0.999 : 1.001) + (found[c] == 0 ? 0.1 : 0);
      q.robot.end_effectors[0].envelope = e;
      const CaptureResult r = simulate_capture(q);
      ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
      EXPECT_EQ(r.grasps[0].captured, tight < 0);
      EXPECT_TRUE(r.grasps[1].captured);
      EXPECT_EQ(r.captured(), tight < 0);
      if (tight < 0) {
        EXPECT_THAT(r.grasps[0].reason, ::testing::StartsWith("within the envelope: "));
        continue;
      }
      char number[40];
      std::snprintf(number, sizeof number, "%s %.4g ", names[tight], found[tight]);
      EXPECT_THAT(r.grasps[0].reason, ::testing::StartsWith("outside the envelope: " + std::string(number)));
      EXPECT_EQ(r.grasps[0].reason.find(','), std::string::npos) << r.grasps[0].reason;
      std::snprintf(number, sizeof number, "of %.4g ", *tolerances[tight]);
      EXPECT_THAT(r.grasps[0].reason, HasSubstr(number));
    }
  }
}

TEST(Envelope, LeavesTheOthersTargetAlone) {
  CaptureProblem p = grasping();
  p.robot.end_effectors[0].envelope = CaptureEnvelope{1e-6, 1, 1, 1};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  ASSERT_EQ(r.grasps.size(), 2u);
  EXPECT_FALSE(r.grasps[0].captured);
  EXPECT_TRUE(r.grasps[1].captured);
  ASSERT_TRUE(r.impact());
  ASSERT_EQ(r.impact()->grasps.size(), 1u);
  EXPECT_EQ(r.impact()->grasps[0].end_effector, "tip-2");
  EXPECT_GT(r.impact()->grasps[0].impulse_magnitude, 1e-3);
  // Target 1 continues in free motion: constant momentum, and its centre on a straight line.
  const std::size_t before = last_sample(r, "approach"), end = r.series.time.size() - 1;
  EXPECT_EQ(r.series.time[end], 15);
  const Vector3d mv = vector_at(r, "targets/target-1/linear_momentum", before);
  for (std::size_t s = before; s <= end; ++s) {
    EXPECT_LT(norm(vector_at(r, "targets/target-1/linear_momentum", s) - mv), 1e-13);
    const Vector3d w = vector_at(r, "targets/target-1/angular_velocity", s);
    EXPECT_LT(norm(w - p.targets[0].V_WT.angular), 1e-11);  // spherical inertia
    const Vector3d line = p.targets[0].X_WT.p + (r.series.time[s] - 10) * p.targets[0].V_WT.linear;
    EXPECT_LT(norm(vector_at(r, "targets/target-1/position", s) - line), 1e-11);
  }
  EXPECT_GT(norm(vector_at(r, "targets/target-2/linear_momentum", end) -
                 vector_at(r, "targets/target-2/linear_momentum", before)),
            1e-3);
  // The impulse equals that of a capture in which target 1 has no grasp.
  CaptureProblem q = p;
  q.grasps.erase(q.grasps.begin());
  q.targets.erase(q.targets.begin());
  q.approach->match.reset();
  q.approach->final_rates = r.plan->final_rates;
  const CaptureResult alone = simulate_capture(q);
  ASSERT_TRUE(alone.impact()) << alone.failure;
  EXPECT_LT(norm(alone.impact()->grasps[0].impulse - r.impact()->grasps[0].impulse), 1e-9);
}

TEST(Envelope, NoClosingNoImpact) {
  CaptureProblem p = grasping();
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope = CaptureEnvelope{1e-6, 1, 1, 1};
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  EXPECT_FALSE(r.captured());
  EXPECT_FALSE(r.impact() || r.post_impact_end);
  EXPECT_TRUE(r.approach_end);
  EXPECT_THAT(r.series.phases, ::testing::ElementsAre("approach"));
  EXPECT_EQ(r.series.time.back(), 10);
}

// Excess over the envelopes: positive outside, zero at the boundary.
double excess(const CaptureProblem& p, const CaptureResult& r, std::size_t s) {
  double most = -1;
  for (std::size_t g = 0; g < p.grasps.size(); ++g) {
    const CaptureEnvelope& e = *p.robot.end_effectors[g].envelope;
    const GraspError m = grasp_error(p, r, g, s);
    most = std::max({most, m.distance() / e.position - 1, norm(m.relative_velocity()) / e.velocity - 1});
  }
  return most;
}

TEST(CaptureAtEnvelope, EndsApproachAtZeroExcess) {
  CaptureProblem p = grasping();
  p.approach->tracking = {};
  p.approach->capture_at = ApproachSetup::CaptureAt::envelope;
  for (EndEffectorSetup& e : p.robot.end_effectors) {
    e.envelope = CaptureEnvelope{};
    e.envelope->position = 0.4, e.envelope->velocity = 0.2;
  }
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  EXPECT_TRUE(r.captured());
  const std::size_t end = last_sample(r, "approach");
  EXPECT_EQ(r.series.time[end], r.capture_time);
  EXPECT_EQ(r.approach_end->time, r.capture_time);
  EXPECT_EQ(r.impact()->time, r.capture_time);
  EXPECT_LT(r.capture_time, 10);
  EXPECT_GT(r.capture_time, 1);
  EXPECT_NEAR(excess(p, r, end), 0, 1e-9);
  for (std::size_t s = 0; s < end; ++s) EXPECT_GT(excess(p, r, s), 0);
  EXPECT_NEAR(r.series.time.back(), r.capture_time + 5, 1e-12);
  std::printf("[ measured ] capture at %.6f s\n", r.capture_time);

  // Never inside: the envelope is evaluated at the end of the approach.
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope->position = 1e-7;
  const CaptureResult never = simulate_capture(p);
  EXPECT_EQ(never.status, CaptureStatus::completed);
  EXPECT_EQ(never.capture_time, 10);
  EXPECT_FALSE(never.captured() || never.impact());
  // Inside from the start: captured immediately.
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope->position = 100, e.envelope->velocity = 100;
  const CaptureResult at_once = simulate_capture(p);
  EXPECT_EQ(at_once.status, CaptureStatus::completed);
  EXPECT_EQ(at_once.capture_time, 0);
  EXPECT_TRUE(at_once.captured());
  expect_passes(at_once);
}

// --- Clearance ------------------------------------------------------------------------------------------------------

Geometry sphere(double radius, const Vector3d& center = {0, 0, 0}) {
  return {Geometry::Shape::sphere, {radius, 0, 0}, {Rotationd::identity(), center}};
}
// Along x, from the body's origin to 1 m.
Geometry link_capsule(double radius) {
  return {Geometry::Shape::capsule, {radius, 1, 0}, {rotation_about({0, 1, 0}, std::numbers::pi / 2), {0.5, 0, 0}}};
}
double point_to_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d d = b - a;
  const double x = std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0);
  return norm(p - a - x * d);
}

TEST(Clearance, ForearmPassingTargetMatchesClosedForm) {
  CaptureProblem p = thesis_case();
  p.impact.reset();
  p.output_interval = 0.02;
  p.robot.geometry = {{"arm-1-link-2", link_capsule(0.05)}};
  TargetSetup rock;
  rock.name = "rock", rock.mass = 5, rock.inertia = Symmetric3d::diagonal(1, 1, 1);
  rock.X_WT.p = {2.15, -0.5, 0.1}, rock.V_WT.linear = {-0.01, 0.005, 0};
  rock.geometry = {sphere(0.2)};
  p.targets.push_back(rock);
  p.clearance.required = 0.1;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  double least = 10, when = 0, begin = -1, end = -1, worst = 0;
  for (std::size_t s = 0; s < r.series.time.size(); ++s) {
    const Posed X = pose_at(r, "links/arm-1-link-2", s);
    const double d = point_to_segment(vector_at(r, "targets/rock/position", s), X.p, X * Vector3d{1, 0, 0}) - 0.25;
    worst = std::max(worst, std::abs(d - series(r, "clearance/minimum").data[s]));
    if (d < least) least = d, when = r.series.time[s];
    if (d < 0.1 && begin < 0) begin = r.series.time[s];
    if (d < 0.1) end = r.series.time[s];
  }
  EXPECT_LT(worst, 1e-14);  // measured 7.2e-16
  ASSERT_LT(least, 0.1);
  ASSERT_EQ(r.clearance.size(), 1u);
  EXPECT_NEAR(r.clearance[0].distance, least, 1e-6);
  EXPECT_NEAR(r.clearance[0].time, when, 0.03);
  EXPECT_THAT((std::vector{r.clearance[0].body_a, r.clearance[0].body_b}),
              ::testing::UnorderedElementsAre("arm-1-link-2", "rock"));
  ASSERT_GE(r.clearance_events.size(), 1u);
  EXPECT_NEAR(r.clearance_events.front().begin_time, begin, 0.021);
  EXPECT_NEAR(r.clearance_events.back().end_time, end, 0.021);
  EXPECT_EQ(r.clearance_events[0].required, 0.1);
  const LedgerEntry& violation = row(r, "clearance_violation");
  EXPECT_EQ(violation.kind, LedgerEntry::Kind::feasibility);
  EXPECT_TRUE(violation.applies);
  EXPECT_NEAR(violation.value, 0.1 - least, 1e-6);
  EXPECT_FALSE(violation.pass());
  EXPECT_FALSE(r.ledger.feasible());
  EXPECT_TRUE(r.ledger.pass());
  std::printf("[ measured ] worst sample %.2g, least %.6f by hand %.6f at %.3f s\n", worst, r.clearance[0].distance,
              least, when);
}

// The grasping link may touch its target before and after the grasp. The link before it may not, even if a fixed joint
// attaches the target to the end-effector.
TEST(Clearance, CapturedTargetFromLinkBeforeEndEffector) {
  for (GraspModel model : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    for (bool end_effector_has_shape : {true, false}) {
      CaptureProblem p = grasping();
      p.targets[0].V_WT = {{0, 0, 0.2}, {0, 0, 0}};
      for (GraspSetup& g : p.grasps) g.model = model;
      p.targets[0].geometry = {sphere(1.7)};
      p.robot.geometry = {{"arm-1-link-2", link_capsule(0.05)}};
      if (end_effector_has_shape) p.robot.geometry.push_back({"arm-1-link-3", link_capsule(0.05)});
      const CaptureResult r = simulate_capture(p);
      ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
      for (const char* phase : {"approach", "post_impact"}) {
        SCOPED_TRACE(phase);
        double least = 10;
        for (std::size_t s = first_sample(r, phase); s <= last_sample(r, phase); ++s) {
          const Posed X = pose_at(r, "links/arm-1-link-2", s);
          const double d = point_to_segment(vector_at(r, "targets/target-1/position", s), X.p, X * Vector3d{1, 0, 0});
          least = std::min(least, d - 1.75);
        }
        EXPECT_LT(least, 0);
        const auto found = std::find_if(r.clearance.begin(), r.clearance.end(),
                                        [&](const MinimumClearance& c) { return c.phase == phase; });
        ASSERT_NE(found, r.clearance.end());
        EXPECT_NEAR(found->distance, least, 1e-3);  // samples against the search between samples
        EXPECT_THAT((std::vector{found->body_a, found->body_b}),
                    ::testing::UnorderedElementsAre("arm-1-link-2", "target-1"));
      }
      p.clearance.ignore = {{"arm-1-link-2", BodyName::of_target(0)}};
      const CaptureResult ignored = simulate_capture(p);
      EXPECT_TRUE(ignored.clearance.empty());
      EXPECT_FALSE(row(ignored, "clearance_violation").applies);
    }
  }
}

// Shapes stay where the user put them when the target's frame moves to the contact.
TEST(Clearance, ShapeOfCapturedTargetStaysInPlace) {
  CaptureProblem p = grasping();
  p.targets[0].geometry = {sphere(0.1, {0.2, -0.3, 0.4})};
  p.targets[1].geometry = {sphere(0.1, {-0.1, 0.2, 0.1})};
  p.robot.geometry = {};
  p.output_interval = 0.05;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.clearance.size(), 2u);
  for (const MinimumClearance& c : r.clearance) {
    double least = 100;
    for (std::size_t s = first_sample(r, c.phase); s <= last_sample(r, c.phase); ++s) {
      const Vector3d a = pose_at(r, "targets/target-1", s) * Vector3d{0.2, -0.3, 0.4};
      const Vector3d b = pose_at(r, "targets/target-2", s) * Vector3d{-0.1, 0.2, 0.1};
      least = std::min(least, norm(a - b) - 0.2);
    }
    EXPECT_NEAR(c.distance, least, 1e-6) << c.phase;
  }
}

// A body with two shapes has the same clearance as two bodies on a fixed joint with one shape each. The second body has
// negligible mass, so that the motions are equal.
TEST(Clearance, TwoShapesEqualTwoFixedBodies) {
  const Geometry bus{Geometry::Shape::box, {0.5, 0.6, 0.7}, {rotation_about({0, 0, 1}, 0.3), {-0.3, 0, 0}}};
  const Geometry panel{Geometry::Shape::box, {0.4, 1.5, 0.02}, {rotation_about({1, 0, 0}, 0.4), {-0.2, 0.6, 0.3}}};
  CaptureProblem one = grasping();
  one.clearance.required = 0.2;
  for (TargetSetup& t : one.targets) t.geometry = {sphere(0.5)};
  one.robot.geometry = {{one.robot.base, bus}, {one.robot.base, panel}};
  CaptureProblem two = one;
  BodyDescription wing = two.robot.bodies[0];
  wing.name = "wing", wing.parent = two.robot.base;
  wing.joint = JointDescription{};  // fixed
  wing.joint.name = "hinge";
  wing.X_PF = {rotation_about({0, 0.6, 0.8}, 0.7), {0.1, 0.2, -0.1}};
  wing.com = Vector3d::zero(), wing.mass = 1e-9, wing.inertia = Symmetric3d::diagonal(1e-9, 1e-9, 1e-9);
  two.robot.bodies.push_back(wing);
  Geometry moved = panel;
  moved.X_BG = inverse(wing.X_PF) * panel.X_BG;
  two.robot.geometry[1] = {"wing", moved};

  const CaptureResult a = simulate_capture(one), b = simulate_capture(two);
  ASSERT_EQ(a.status, CaptureStatus::completed) << a.failure;
  ASSERT_EQ(b.status, CaptureStatus::completed) << b.failure;
  ASSERT_EQ(a.clearance.size(), b.clearance.size());
  std::set<std::string> nearest;
  for (std::size_t i = 0; i < a.clearance.size(); ++i) {
    EXPECT_NEAR(a.clearance[i].distance, b.clearance[i].distance, 1e-9);
    nearest.insert({b.clearance[i].body_a, b.clearance[i].body_b});
  }
  EXPECT_TRUE(nearest.contains("wing"));  // otherwise the second shape is not tested
  const std::vector<double>& least = series(a, "clearance/minimum").data;
  double worst = 0;
  for (std::size_t s = 0; s < least.size(); ++s)
    worst = std::max(worst, std::abs(least[s] - series(b, "clearance/minimum").data[s]));
  EXPECT_LT(worst, 1e-9);  // measured 1e-12
  std::printf("[ measured ] worst sample %.2g\n", worst);
}

// --- Joint limits ---------------------------------------------------------------------------------------------------

TEST(Limits, PositionRateAndEffortInBothPhases) {
  CaptureProblem p = grasping();
  p.approach->tracking = {};
  p.post_impact->joints = PostImpactSetup::Joints::free;
  p.output_interval = 0.02;
  CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_FALSE(row(r, "joint_position_violation").applies);
  // Limits inside the joints' recorded ranges.
  const auto range = [&](const char* path, int joint, const char* phase) {
    double low = 1e9, high = -1e9;
    for (std::size_t s = first_sample(r, phase); s <= last_sample(r, phase); ++s) {
      low = std::min(low, value_at(r, path, s, joint)), high = std::max(high, value_at(r, path, s, joint));
    }
    return std::pair{low, high};
  };
  JointLimits& l1 = p.robot.bodies[1].joint.limits;
  l1.lower = range("joints/position", 0, "approach").first + 0.1;
  JointLimits& l2 = p.robot.bodies[2].joint.limits;
  const auto [low_rate, high_rate] = range("joints/velocity", 1, "approach");
  l2.rate = 0.8 * std::max(-low_rate, high_rate);
  JointLimits& l3 = p.robot.bodies[3].joint.limits;
  const auto [low_effort, high_effort] = range("joints/effort", 2, "approach");
  l3.effort = 0.7 * std::max(-low_effort, high_effort);
  JointLimits& l4 = p.robot.bodies[4].joint.limits;
  const auto [low4, high4] = range("joints/position", 3, "post_impact");
  l4.upper = std::max(range("joints/position", 3, "approach").second, 0.5 * (low4 + high4));
  l4.lower = std::min(range("joints/position", 3, "approach").first, 0.5 * (low4 + high4));
  const CaptureResult limited = simulate_capture(p);
  ASSERT_EQ(limited.status, CaptureStatus::completed);
  int kinds[4] = {0, 0, 0, 0}, later = 0;
  double excess[4] = {0, 0, 0, 0};
  for (const LimitEvent& e : limited.limit_events) {
    const int kind = static_cast<int>(e.kind);
    ++kinds[kind];
    later += e.phase == "post_impact";
    excess[kind] = std::max(excess[kind], std::abs(e.worst_value - e.limit));
    EXPECT_LE(e.begin_time, e.worst_time);
    EXPECT_LE(e.worst_time, e.end_time);
  }
  EXPECT_GE(kinds[0], 1);
  EXPECT_GE(kinds[1], 1);
  EXPECT_GE(kinds[2], 1);
  EXPECT_EQ(kinds[3], 0);  // ideal tracking is not clipped
  // The effort may be larger between samples.
  EXPECT_GE(row(limited, "joint_effort_violation").value, 0.3 / 0.7 * l3.effort * (1 - 1e-9));
  EXPECT_LE(row(limited, "joint_effort_violation").value, 0.3 / 0.7 * l3.effort * (1 + 1e-2));
  const auto [low_after, high_after] = range("joints/velocity", 1, "post_impact");
  const double fastest = std::max(l2.rate / 0.8, std::max(-low_after, high_after));
  EXPECT_NEAR(row(limited, "joint_rate_violation").value, fastest - l2.rate, 1e-4);
  EXPECT_GE(row(limited, "joint_position_violation").value, 0.1 - 1e-6);
  EXPECT_GE(later, 1);
  EXPECT_FALSE(limited.ledger.feasible());
  EXPECT_TRUE(limited.ledger.pass());
  // The checks do not change the motion.
  EXPECT_EQ(std::memcmp(series(r, "base/position").data.data(), series(limited, "base/position").data.data(),
                        series(r, "base/position").data.size() * sizeof(double)),
            0);
}

}  // namespace envelope_test
}  // namespace grapnel::testing
