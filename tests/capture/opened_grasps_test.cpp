/// End-effectors that have let their target go, or never held it, are checked against it: after a rebound, a miss, a
/// release, a contact that parts. What touches may separate without a violation.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_case.hpp"

namespace grapnel::testing {
namespace opened_grasps_test {

constexpr double kHand = 0.1, kBall = 0.5;  // radii [m]

// A base with one slide along x that carries a ball as its end-effector, and a heavy ball before it. They touch where
// the slide is at 1.4 m, after 10 s, at 0.05 m/s.
CaptureProblem slide() {
  CaptureProblem p;
  p.robot.name = "slide", p.robot.base = "base";
  BodyDescription base, hand;
  base.name = base.joint.name = "base", base.mass = 5000, base.inertia = Symmetric3d::diagonal(900, 900, 900);
  hand.name = "hand", hand.joint.name = "slide", hand.parent = "base";
  hand.joint.type = JointType::prismatic, hand.joint.axis = {1, 0, 0};
  hand.mass = 10, hand.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
  p.robot.bodies = {base, hand};
  EndEffectorSetup tip;
  tip.name = "tip", tip.body = "hand", tip.X_BE.p = {kHand, 0, 0};
  p.robot.end_effectors = {tip};
  const auto ball = [](double radius) { return Geometry{Geometry::Shape::sphere, {radius, 0, 0}, Posed::identity()}; };
  p.robot.geometry = {{"base", ball(0.3)}, {"hand", ball(kHand)}};
  TargetSetup target;
  target.name = "ball", target.mass = 2000, target.inertia = Symmetric3d::diagonal(300, 300, 300);
  target.X_WT.p = {1.4 + kHand + kBall, 0, 0};
  target.geometry = {ball(kBall)};
  target.grasp_points = {{"front", {Rotationd::identity(), {-kBall, 0, 0}}}};
  target.grasp_points[0].normal = Vector3d{-1, 0, 0};
  p.targets = {target};
  p.grasps = {{"tip", "ball", "front", GraspModel::rigid, {0, 0, 1}}};
  p.joint_position = {0.8};
  p.approach.emplace();
  p.approach->duration = 10, p.approach->final_position = {1.4}, p.approach->final_rates = {{0.05}};
  p.contact.largest_gap = 0.2;
  p.impact.emplace();
  p.post_impact.emplace();
  p.post_impact->duration = 8, p.post_impact->joints = PostImpactSetup::Joints::pd;
  p.post_impact->kp = {4000}, p.post_impact->kd = {400};
  p.clearance.required = 0.01;
  p.output_interval = 0.1;
  return p;
}

void move_by(CaptureProblem& p, double distance, double after) {
  p.post_impact->move = PostureMove{{1.4 + distance}, after, 3, JointProfile::quintic};
}

void expect_no_violation(const CaptureResult& r) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.clearance_events.empty())
      << r.clearance_events[0].least.body_a << " " << r.clearance_events[0].least.distance;
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
}

void expect_overlap(const CaptureResult& r, double depth) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_EQ(r.ledger.feasibility(), Verdict::no);
  ASSERT_FALSE(r.clearance_events.empty());
  double deepest = 0;
  for (const ClearanceEvent& e : r.clearance_events) {
    EXPECT_THAT((std::vector<std::string>{e.least.body_a, e.least.body_b}),
                ::testing::UnorderedElementsAre("hand", "ball"));
    deepest = std::max(deepest, -e.least.distance);
  }
  EXPECT_NEAR(deepest, depth, 0.05);
  ASSERT_TRUE(r.valid_until);
  EXPECT_GT(*r.valid_until, 6);
  EXPECT_NEAR(row(r, "clearance_violation").value, deepest + 0.01, 1e-9);
}

CaptureProblem rebound(ImpactSetup::Law law) {
  CaptureProblem p = slide();
  p.grasps[0].contact = true;
  p.impact->law = law, p.impact->restitution = 0.4, p.impact->friction = 0.2;
  return p;
}

TEST(OpenedGrasps, SeparatingReboundIsNoViolation) {
  for (const auto law : {ImpactSetup::Law::restitution, ImpactSetup::Law::friction}) {
    CaptureProblem p = rebound(law);
    move_by(p, -0.3, 0.1);
    expect_no_violation(simulate_capture(p));
  }
}

TEST(OpenedGrasps, PenetrationAfterReboundIsViolation) {
  for (const auto law : {ImpactSetup::Law::restitution, ImpactSetup::Law::friction}) {
    CaptureProblem p = rebound(law);
    move_by(p, 0.35, 0.5);
    const CaptureResult r = simulate_capture(p);
    const std::size_t end = r.series.time.size() - 1;
    const double gap = norm(pose_at(r, "targets/ball", end).p - pose_at(r, "end_effectors/tip", end).p) - kBall;
    ASSERT_LT(gap, -0.05);  // so far it is inside in the end, by the recorded poses
    expect_overlap(r, -gap);
  }
}

CaptureProblem soft_contact() {
  CaptureProblem p = rebound(ImpactSetup::Law::compliant);
  p.impact->contact.stiffness = 2e4, p.impact->contact.damping = 50;
  return p;
}

TEST(OpenedGrasps, CompliantContactsThatSeparate) {
  CaptureProblem p = soft_contact();
  move_by(p, -0.3, 0.1);
  expect_no_violation(simulate_capture(p));
  move_by(p, 0.3, 0.5);
  const CaptureResult r = simulate_capture(p);
  const std::size_t end = r.series.time.size() - 1;
  const double gap = norm(pose_at(r, "targets/ball", end).p - pose_at(r, "end_effectors/tip", end).p) - kBall;
  ASSERT_LT(gap, -0.05);
  expect_overlap(r, -gap);
}

TEST(OpenedGrasps, SeparatingReleaseIsNoViolation) {
  CaptureProblem p = slide();
  p.post_impact->releases = {{1, {}}};
  move_by(p, -0.3, 1.2);
  expect_no_violation(simulate_capture(p));
  // Nor one where nothing moves: the end-effector stays at the target's surface.
  p.post_impact->move.reset();
  expect_no_violation(simulate_capture(p));
  // Nor where hand and target overlap by design, up to that depth.
  p = slide();
  p.targets[0].X_WT.p[0] -= 0.04, p.targets[0].grasp_points[0].X_TG.p[0] += 0.04;
  p.post_impact->releases = {{1, {}}};
  move_by(p, -0.3, 1.2);
  expect_no_violation(simulate_capture(p));
}

TEST(OpenedGrasps, PenetrationAfterReleaseIsViolation) {
  CaptureProblem p = slide();
  p.post_impact->releases = {{1, {}}};
  move_by(p, 0.3, 1.2);
  const CaptureResult r = simulate_capture(p);
  const std::size_t end = r.series.time.size() - 1;
  const double gap = norm(pose_at(r, "targets/ball", end).p - pose_at(r, "end_effectors/tip", end).p) - kBall;
  ASSERT_LT(gap, -0.05);
  expect_overlap(r, -gap);
  // The grasp that holds is not checked.
  p.post_impact->releases.clear();
  expect_no_violation(simulate_capture(p));
}

// The gripper closes on slow targets only, and the approach continues after a missed capture.
TEST(OpenedGrasps, PenetrationAfterMissedCaptureIsViolation) {
  CaptureProblem p = slide();
  p.robot.end_effectors[0].envelope = CaptureEnvelope{.position = 0.3, .velocity = 1e-3};
  p.grasps[0].closes = GraspSetup::Closes::at_time, p.grasps[0].closes_at = 6;
  p.approach->final_position = {1.55};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.grasps.size(), 1u);
  ASSERT_FALSE(r.grasps[0].captured);
  expect_overlap(r, 0.15);
  // Where it arrives beside the surface, the miss alone is no violation.
  p.approach->final_position = {1.35};
  expect_no_violation(simulate_capture(p));
}

// Without samples the same is found.
TEST(OpenedGrasps, AreCheckedInColumns) {
  CaptureProblem p = rebound(ImpactSetup::Law::restitution);
  move_by(p, 0.35, 0.5);
  const CaptureResult full = simulate_capture(p), columns = simulate_capture(p, {}, CaptureDetail::columns);
  EXPECT_EQ(columns.ledger.feasibility(), Verdict::no);
  ASSERT_FALSE(columns.clearance_events.empty());
  EXPECT_NEAR(columns.clearance_events[0].begin_time, full.clearance_events[0].begin_time, 0.05);
}

}  // namespace opened_grasps_test
}  // namespace grapnel::testing
