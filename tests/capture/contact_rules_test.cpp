/// contact.gap: what happens to the distance between end-effector and grasp point.

#include <gtest/gtest.h>

#include <limits>

#include <algorithm>

#include "capture/capture_case.hpp"

namespace grapnel::testing {
namespace contact_rules_test {

CaptureProblem lagging() {
  CaptureProblem p = thesis_case_pd();
  p.post_impact.emplace();
  p.post_impact->duration = 5;
  return p;
}

TEST(WeldAsFound, PreservesRelativePose) {
  const CaptureResult r = simulate_capture(lagging());
  expect_passes(r);
  const std::size_t contact = first_sample(r, "contact"), after = first_sample(r, "post_impact");
  ASSERT_LT(after, r.series.time.size());
  for (const GraspImpulse& g : r.impact()->grasps) {
    EXPECT_GT(g.gap, 0.05);
    EXPECT_EQ(norm(g.target_displacement), 0);
    const std::string tip = "end_effectors/" + g.end_effector, target = "targets/" + g.target;
    EXPECT_LT(norm(g.contact_point - pose_at(r, tip, contact).p), 1e-15);  // at the tip
    const Posed found = inverse(pose_at(r, tip, contact)) * pose_at(r, target, contact);
    for (std::size_t s = after; s < r.series.time.size(); ++s) {
      const Posed now = inverse(pose_at(r, tip, s)) * pose_at(r, target, s);
      EXPECT_LT(norm(now.p - found.p), 1e-12);  // measured 1e-15
      EXPECT_LT(rotation_angle(transpose(found.R) * now.R), 1e-12);
      EXPECT_NEAR(value_at(r, "grasps/" + g.end_effector + "/distance", s), g.gap, 1e-12);
    }
  }
}

TEST(TranslateTarget, MovesGraspPointToTip) {
  CaptureProblem p = lagging();
  p.contact.gap = ContactSetup::Gap::translate_target;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t contact = first_sample(r, "contact");
  for (std::size_t i = 0; i < 2; ++i) {
    const GraspImpulse& g = r.impact()->grasps[i];
    const EndEffectorMotion& e = r.approach_end->end_effectors[i];
    EXPECT_EQ(g.gap, e.miss_distance);
    EXPECT_GT(g.gap, 0.05);
    EXPECT_NEAR(norm(g.target_displacement), g.gap, 1e-15);
    EXPECT_LT(norm(vector_at(r, "targets/" + g.target + "/position", contact) -
                   (vector_at(r, "targets/" + g.target + "/position", contact - 1) + g.target_displacement)),
              1e-14);
    for (std::size_t s = contact; s < r.series.time.size(); ++s) {
      EXPECT_LT(value_at(r, "grasps/" + g.end_effector + "/distance", s), 1e-12);  // measured 8e-16
    }
    // The target keeps its orientation and velocity.
    EXPECT_LT(norm(r.impact()->targets_before[i].velocity - r.approach_end->targets[i].velocity), 1e-15);
  }
  const CaptureResult welded = simulate_capture(lagging());
  EXPECT_GT(norm(welded.impact()->grasps[0].impulse - r.impact()->grasps[0].impulse), 1e-3);  // the rule matters
}

TEST(Refuse, ReportsGapAndRetainsApproach) {
  CaptureProblem p = lagging();
  p.contact = {ContactSetup::Gap::refuse, 0.08};  // between the two misses
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  ASSERT_TRUE(r.approach_end);
  const double miss = r.approach_end->end_effectors[0].miss_distance;
  ASSERT_GT(miss, 0.08);
  ASSERT_LT(r.approach_end->end_effectors[1].miss_distance, 0.08);
  char number[32];
  std::snprintf(number, sizeof number, "%.4g", miss);
  EXPECT_EQ(r.failure,
            std::string("contact refused: end-effector 'tip-1' misses grasp point 'grasp' of target 'target-1' by ") +
                number + " m; contact.limit is 0.08 m");
  EXPECT_FALSE(r.captured());
  EXPECT_EQ(r.grasps.at(0).reason, r.failure);
  EXPECT_FALSE(r.impact());
  EXPECT_FALSE(r.post_impact_end);
  EXPECT_EQ(r.series.time.back(), 20);
  EXPECT_EQ(r.cost.size(), 1u);
  EXPECT_LT(row(r, "linear_momentum_drift").value, 1e-11);
  EXPECT_TRUE(row(r, "work_energy_residual").applies);
}

TEST(Refuse, NamesEveryArmBeyondLimit) {
  CaptureProblem p = lagging();
  p.contact = {ContactSetup::Gap::refuse, 0.001};
  const CaptureResult r = simulate_capture(p);
  EXPECT_NE(r.failure.find("'tip-1'"), std::string::npos);
  EXPECT_NE(r.failure.find("; end-effector 'tip-2' misses"), std::string::npos) << r.failure;
}

TEST(Refuse, WithinLimitEqualsWeldAsFound) {
  CaptureProblem p = lagging();
  const CaptureResult welded = simulate_capture(p);
  p.contact = {ContactSetup::Gap::refuse, 0.5};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_EQ(norm(r.impact()->grasps[0].impulse - welded.impact()->grasps[0].impulse), 0);
}

// Two arms on one target: it moves by the mean of the two gaps. A target beyond the arm's reach is not moved, unless
// the user sets contact.largest_gap.
TEST(TranslateTarget, LimitedByReach) {
  CaptureProblem p = lagging();
  p.contact.gap = ContactSetup::Gap::translate_target;
  p.contact.largest_gap.reset();
  p.targets[0].X_WT.p = {38, 0, 0};
  const CaptureResult far = simulate_capture(p);
  EXPECT_EQ(far.status, CaptureStatus::failed);
  EXPECT_NE(far.failure.find("more than its arm's reach of 3 m"), std::string::npos) << far.failure;
  EXPECT_EQ(far.capture_verdict(), Captured::no);
  p.contact.largest_gap = std::numeric_limits<double>::infinity();
  EXPECT_EQ(simulate_capture(p).capture_verdict(), Captured::assumed);
}

TEST(TranslateTarget, SharedTargetMovesByMeanGap) {
  CaptureProblem p = thesis_case_pd();
  p.targets.pop_back();
  p.targets[0].X_WT.p = {0, 0, 0};
  p.targets[0].grasp_points = {{"a", {Rotationd::identity(), {2, -1.5, 0}}},
                               {"b", {Rotationd::identity(), {-2, 1.5, 0}}}};
  p.grasps[0].grasp_point = "a";
  p.grasps[1].target = "target-1", p.grasps[1].grasp_point = "b";
  p.contact.gap = ContactSetup::Gap::translate_target;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.impact()->grasps.size(), 2u);
  EXPECT_LT(norm(r.impact()->grasps[0].target_displacement - r.impact()->grasps[1].target_displacement), 1e-16);
  const std::size_t contact = first_sample(r, "contact");
  Vector3d sum = Vector3d::zero();
  for (const char* i : {"1", "2"}) {
    sum += vector_at(r, std::string("end_effectors/tip-") + i + "/position", contact);
    const Posed X = pose_at(r, "targets/target-1", contact);
    sum += -(X * (i[0] == '1' ? Vector3d{2, -1.5, 0} : Vector3d{-2, 1.5, 0}));
  }
  EXPECT_LT(norm(sum), 1e-13);  // the remaining gaps are opposite
  EXPECT_EQ(r.impact()->rows, 12);
  EXPECT_EQ(r.impact()->rank, 9);
  EXPECT_EQ(r.impact()->grasps[0].determined, (std::vector<bool>{false, false, true, true, true, false}));
  EXPECT_TRUE(r.impact()->as_published);  // with the least-squares reading of J_t^-1
}

// A grasp without an envelope is not evaluated: its verdict is `assumed`, and the report states the gap.
TEST(CapturedVerdict, AssumedWithoutEnvelope) {
  CaptureProblem p = lagging();
  const CaptureResult welded = simulate_capture(p);
  EXPECT_EQ(welded.capture_verdict(), Captured::assumed);
  EXPECT_FALSE(welded.grasps[0].judged);
  EXPECT_EQ(welded.grasps[0].target_moved, 0);
  EXPECT_GT(welded.grasps[0].distance, 0.05);
  // An envelope without a distance limit does not evaluate the distance.
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope.emplace().velocity = 1;
  EXPECT_EQ(simulate_capture(p).capture_verdict(), Captured::assumed);
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope->position = 0.2;
  const CaptureResult judged = simulate_capture(p);
  EXPECT_EQ(judged.capture_verdict(), Captured::yes);
  EXPECT_TRUE(judged.grasps[0].judged && judged.grasps[0].limiting.empty());
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope->position = 0.09, e.envelope->velocity = 0.001;
  const CaptureResult missed = simulate_capture(p);
  EXPECT_EQ(missed.capture_verdict(), Captured::no);
  EXPECT_EQ(missed.grasps[0].limiting, "velocity");  // 2.8 times the tolerance, the distance 1.2 times
  EXPECT_TRUE(missed.grasps[0].judged);
}

TEST(CapturedVerdict, ReportsDisplacementOfTarget) {
  CaptureProblem p = lagging();
  p.contact.gap = ContactSetup::Gap::translate_target;
  const CaptureResult r = simulate_capture(p);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(r.grasps[i].target_moved, r.impact()->grasps[i].gap, 1e-15);
    EXPECT_EQ(r.grasps[i].distance, r.impact()->grasps[i].gap);
  }
}

// A target 38 m away is not captured unless the user sets contact.largest_gap.
TEST(LargestGap, DefaultIsTenthOfReach) {
  CaptureProblem p = thesis_case_pd();
  p.contact.largest_gap.reset();
  p.targets[0].X_WT.p = {40, -2, 0};
  const CaptureResult far = simulate_capture(p);
  EXPECT_EQ(far.status, CaptureStatus::failed);
  EXPECT_NE(far.failure.find("contact refused: end-effector 'tip-1' is 3"), std::string::npos) << far.failure;
  EXPECT_NE(far.failure.find("more than a tenth of its arm's reach of 3 m"), std::string::npos) << far.failure;
  EXPECT_EQ(far.failure.find("tip-2"), std::string::npos) << far.failure;
  EXPECT_EQ(far.capture_verdict(), Captured::no);
  EXPECT_FALSE(far.impact());

  // Without an impact no grasp closes, and there is no capture.
  CaptureProblem only = p;
  only.impact.reset();
  EXPECT_EQ(simulate_capture(only).capture_verdict(), Captured::no);

  p.contact.largest_gap = 39;
  EXPECT_EQ(simulate_capture(p).capture_verdict(), Captured::assumed);
  p.contact.largest_gap = 0.08;  // between the two misses of the case itself
  p.targets[0] = thesis_case_pd().targets[0];
  const CaptureResult stated = simulate_capture(p);
  EXPECT_NE(stated.failure.find("contact.largest_gap is 0.08 m"), std::string::npos) << stated.failure;
  // An envelope takes precedence over contact.largest_gap.
  for (EndEffectorSetup& e : p.robot.end_effectors) e.envelope.emplace().position = 0.2;
  EXPECT_EQ(simulate_capture(p).capture_verdict(), Captured::yes);
}

CaptureProblem with_balls(double radius) {
  CaptureProblem p = lagging();
  Geometry ball;
  ball.shape = Geometry::Shape::sphere, ball.size = {radius, 0, 0};
  for (const BodyDescription& body : p.robot.bodies) p.robot.geometry.emplace_back(body.name, ball);
  for (TargetSetup& t : p.targets) t.geometry = {ball};
  return p;
}

double min_clearance(const CaptureResult& r) {
  double least = 10;
  for (const MinimumClearance& phase : r.clearance) least = std::min(least, phase.distance);
  return least;
}

// Without a check the verdict is `not_checked`.
TEST(Feasibility, NotCheckedWithoutChecks) {
  CaptureProblem p = lagging();
  const CaptureResult none = simulate_capture(p);
  EXPECT_EQ(none.ledger.feasibility(), Verdict::not_checked);
  EXPECT_EQ(row(none, "clearance_violation").not_checked, "no body has a shape");
  EXPECT_FALSE(row(none, "joint_rate_violation").applies);
  EXPECT_TRUE(row(none, "joint_rate_violation").not_checked.empty());  // no limits are stated: nothing to check

  p = with_balls(0.01);
  for (TargetSetup& t : p.targets) t.geometry = {Geometry{}};
  const CaptureResult some = simulate_capture(p);
  EXPECT_EQ(some.ledger.feasibility(), Verdict::not_checked);
  EXPECT_EQ(row(some, "clearance_violation").not_checked, "no shape is stated for target-1, target-2");
  EXPECT_TRUE(row(some, "clearance_violation").applies);

  p = with_balls(0.01);
  const CaptureResult all = simulate_capture(p);
  EXPECT_EQ(all.ledger.feasibility(), Verdict::yes) << min_clearance(all);
  EXPECT_FALSE(all.first_violation || all.valid_until);
  p.clearance.enabled = false;
  const CaptureResult off = simulate_capture(p);
  EXPECT_EQ(off.ledger.feasibility(), Verdict::not_checked);
  EXPECT_EQ(row(off, "clearance_violation").not_checked, "switched off by clearance.enabled");

  // A violation gives the verdict no, even if other checks are missing.
  for (BodyDescription& body : p.robot.bodies) body.joint.limits.rate = 1e-3;
  const CaptureResult slow = simulate_capture(p);
  EXPECT_EQ(slow.ledger.feasibility(), Verdict::no);
  ASSERT_TRUE(slow.first_violation);
  EXPECT_EQ(slow.first_violation->kind, "rate");
  EXPECT_EQ(slow.first_violation->phase, "approach");
  EXPECT_LT(slow.first_violation->time, 2);  // the quartic profile begins slowly
}

// The results are valid until the first overlap.
TEST(Feasibility, ValidUntilFirstOverlap) {
  CaptureProblem p = with_balls(0.01);
  const double least = min_clearance(simulate_capture(p));
  ASSERT_GT(least, 0);
  p.clearance.required = least + 0.01;
  const CaptureResult near = simulate_capture(p);
  EXPECT_EQ(near.ledger.feasibility(), Verdict::no);
  EXPECT_FALSE(near.valid_until);
  ASSERT_TRUE(near.first_violation);
  EXPECT_EQ(near.first_violation->kind, "clearance");

  p = with_balls(0.01 + least / 2 + 0.005);
  const CaptureResult touching = simulate_capture(p);
  ASSERT_TRUE(touching.valid_until);
  EXPECT_EQ(touching.first_violation->kind, "overlap");
  EXPECT_EQ(touching.first_violation->time, *touching.valid_until);
  double first = 100;
  for (const ClearanceEvent& e : touching.clearance_events) first = std::min(first, e.overlap_begin.value_or(100));
  EXPECT_EQ(*touching.valid_until, first);
}

}  // namespace contact_rules_test
}  // namespace grapnel::testing
