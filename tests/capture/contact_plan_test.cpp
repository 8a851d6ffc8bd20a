/// Planned approaches and contacts between shapes: predicted motion of targets, pairs that a plan keeps apart, and the
/// comparison of plan and simulation.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "capture/scenario_run.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/predicted_contacts.hpp"

namespace grapnel::testing {
namespace contact_plan_test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kCapture = 20;  // [s]

// A base with an arm that slides along x, the end-effector on a ball, and a box of 20 kg on the same axis.
std::string sliding(const std::string& box, const std::string& rest, double position_envelope = 1e-3) {
  return "schema: grapnel-scenario/1\n"
         "name: sliding\n" +
         sliding_arm(", geometry: {shape: box, size: [0.5, 0.5, 0.5]}",
                     ", envelope: {position: " + std::to_string(position_envelope) + "}") +
         "targets:\n"
         "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: " +
         box + ", grasp_points: [{name: face, position: [-0.18, 0, 0]}]}\n" + rest +
         "materials: [{name: pad, stiffness: 2e4, restitution: 0.5, friction: 0.3}]\n"
         "grasps: [{end_effector: tip, target: box, point: face}]\n"
         "impact: {}\n"
         "post_impact: {duration: 1, joints: braked}\n";
}
std::string approach(const std::string& keys = "plan: {}") { return "approach: {duration: 20, " + keys + "}\n"; }
// A ball of 20 kg that follows the box, and meets it at t = 5 s.
const char* const kBall =
    "  - {name: ball, mass: 20, inertia: [0.1, 0.1, 0.1], geometry: {shape: sphere, radius: 0.1}, state: {at: start, "
    "position: [2.8, 0, 0], velocity: [-0.1, 0, 0]}}\n";
const char* const kTouchingBall = "contacts: {pairs: [[box, ball]], material: pad}\n";

CaptureProblem problem_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text));
}

// --- Predicted motion of targets

// A ball pushes the box before the capture: the plan leads to where the box is then, by the central impact of equal
// masses with the coefficient 0.5.
TEST(PredictedContacts, APlanMeetsATargetThatAnotherOneHasPushed) {
  const CaptureResult r =
      simulate_capture(problem_of(sliding("{at: start, position: [2, 0, 0]}", kBall + approach() + kTouchingBall)));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_EQ(r.plan->contacts.size(), 1u);
  const PlannedContact& contact = r.plan->contacts[0];
  EXPECT_NEAR(contact.predicted.value(), 5, 1e-9);
  EXPECT_NEAR(contact.simulated.value(), *contact.predicted, 1e-9);
  EXPECT_FALSE(contact.disturbs);
  EXPECT_EQ(r.capture_verdict(), Captured::yes);
  EXPECT_LT(r.grasps[0].distance, 1e-8);
  EXPECT_LT(r.grasps[0].velocity, 1e-8);
  ASSERT_TRUE(r.approach_end);
  EXPECT_NEAR(r.approach_end->targets[0].velocity[0], -0.1 * 1.5 / 2, 1e-6);
  EXPECT_THAT(r.warnings, Not(Contains(HasSubstr("touch"))));
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
}

// The motion at any time is that of the free targets before the contact, and after it.
TEST(PredictedContacts, TheMotionIsThatOfFreeTargetsBetweenContacts) {
  const CaptureProblem p = problem_of(sliding("{at: start, position: [2, 0, 0]}", kBall + approach() + kTouchingBall));
  const TargetPlan free = plan_targets(p), plan = predict_contacts(p, free, 0, kCapture);
  ASSERT_EQ(plan.contacts.size(), 1u);
  EXPECT_EQ(motion_in_plan(p, plan, 0, kCapture, 4).X_WT.p[0], 2);
  const TargetMotion at_10 = motion_in_plan(p, plan, 0, kCapture, 10);
  const double moved = plan.capture[0].X_WT.p[0] - at_10.X_WT.p[0];
  EXPECT_NEAR(moved, 10 * plan.capture[0].V_WT.linear[0], 1e-12);
  EXPECT_NEAR(at_10.X_WT.p[0], 2 - 0.075 * 5, 5e-3);  // the contact lasts some 0.1 s
  EXPECT_TRUE(touches_after(plan, 4));
  EXPECT_FALSE(touches_after(plan, 6));
}

// Without contact before the capture the motion is that of free targets, bit by bit.
TEST(PredictedContacts, TargetsThatTouchNothingKeepTheirFreeMotion) {
  CaptureProblem p = problem_of(sliding("{at: start, position: [2, 0, 0], angular_velocity: [0.1, 0.2, 0.3]}",
                                        kBall + approach() + kTouchingBall));
  p.targets[1].V_WT.linear = {0.1, 0, 0};
  const TargetPlan free = plan_targets(p), plan = predict_contacts(p, free, 0, kCapture);
  EXPECT_THAT(plan.contacts, IsEmpty());
  EXPECT_THAT(plan.instants, IsEmpty());
  EXPECT_EQ(norm(plan.capture[0].X_WT.p - free.capture[0].X_WT.p), 0);
  EXPECT_EQ(norm(plan.capture[0].V_WT.angular - free.capture[0].V_WT.angular), 0);
}

// A hard impact on a wall in an instant: afterwards the box flies back with the stated restitution.
TEST(PredictedContacts, ATargetReboundsFromAHardWall) {
  const std::string wall =
      "obstacles: [{name: wall, half_space: true, position: [3.2, 0, 0], rpy: [0, -1.5707963267948966, 0]}]\n";
  std::string text = sliding("{at: start, position: [2.5, 0, 0], velocity: [0.1, 0, 0]}",
                             wall + approach() + "contacts: {pairs: [[box, wall]], material: pad}\n");
  const std::string soft = "stiffness: 2e4, restitution";
  text.replace(text.find(soft), soft.size(), "stiffness: 2e6, hard: true, restitution");
  const CaptureResult r = simulate_capture(problem_of(text));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_EQ(r.plan->contacts.size(), 1u);
  EXPECT_NEAR(r.plan->contacts[0].predicted.value(), 5, 1e-8);
  EXPECT_EQ(r.capture_verdict(), Captured::yes);
  EXPECT_LT(r.grasps[0].distance, 1e-8);
  EXPECT_NEAR(r.approach_end->targets[0].position[0], 3 - 0.05 * 15, 1e-6);
}

TEST(PredictedContacts, AWarningNamesATargetStatedAtTheCaptureThatTouchesBefore) {
  const CaptureResult r =
      simulate_capture(problem_of(sliding("{at: capture, position: [2, 0, 0]}", kBall + approach() + kTouchingBall)));
  EXPECT_THAT(r.warnings, Contains(HasSubstr("targets.box.state: it is stated at the capture, t = 20 s, but box and "
                                             "ball touch before, at t = 5 s")));
}

// A straight approach after the contact is that to the target as it moves then; a contact during it is followed, with a
// warning.
TEST(PredictedContacts, AStraightApproachFollowsAPushedTarget) {
  for (const std::string duration : {"10", "17"}) {
    SCOPED_TRACE(duration);
    std::string text = sliding(
        "{at: start, position: [2, 0, 0]}",
        kBall + approach("plan: {}, straight_in: {stand_off: 0.1, duration: " + duration + "}") + kTouchingBall);
    const auto replace = [&](const std::string& what, const std::string& by) {
      text.replace(text.find(what), what.size(), by);
    };
    replace("name: face, ", "name: face, approach_direction: [1, 0, 0], ");
    replace("point: face}", "point: face, orientation: free}");
    const CaptureResult r = simulate_capture(problem_of(text));
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    EXPECT_EQ(r.capture_verdict(), Captured::yes);
    EXPECT_LT(r.grasps[0].distance, 1e-8);  // measured 3e-12 and 4e-11
    const auto warned = Contains(HasSubstr("targets touch during the final straight approach"));
    if (duration == "17")
      EXPECT_THAT(r.warnings, warned);
    else
      EXPECT_THAT(r.warnings, Not(warned));
  }
}

TEST(PredictedContacts, ACaptureWindowUsesTheMotionAfterContacts) {
  // The box comes within reach only after the ball has pushed it.
  std::string text = sliding(
      "{at: start, position: [2, 0, 0]}",
      kBall + std::string("approach: {window: {earliest: 2, latest: 20, step: 6, choose: soonest}, plan: {}}\n") +
          kTouchingBall);
  const std::string axis = "axis: [1, 0, 0], origin";
  text.replace(text.find(axis), axis.size(), "axis: [1, 0, 0], limits: {lower: -1, upper: 0.7}, origin");
  const CaptureResult r = simulate_capture(problem_of(text));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  // The arm carries its end-effector to x = 0.8 + 0.7 (1 - 5/105) m; the box moves with 0.075 m/s from t = 5.03 s on.
  EXPECT_NEAR(r.plan->window->time, 9.74, 0.02);  // measured 9.734: the envelope accepts half a millimetre
  EXPECT_LT(r.grasps[0].distance, 5e-4);
}

// --- Contacts of the servicer

// The grasp point is 20 mm inside the box, so that the ball of the gripper touches the box before the capture.
std::string early_contact(double envelope) {
  return sliding("{at: start, position: [2, 0, 0]}", approach() + "contacts: {pairs: [[arm, box]], material: pad}\n",
                 envelope);
}

TEST(UnplannedContact, AFailedCaptureIsInfeasibleAndNamesTheContact) {
  const CaptureResult r = simulate_capture(problem_of(early_contact(1e-3)));
  ASSERT_EQ(r.plan->contacts.size(), 1u);
  const PlannedContact& contact = r.plan->contacts[0];
  EXPECT_FALSE(contact.predicted);
  EXPECT_LT(contact.simulated.value(), kCapture);
  EXPECT_TRUE(contact.disturbs);
  EXPECT_FALSE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::no);
  EXPECT_THAT(feasibility_sentence(r), HasSubstr("feasible: NO: arm and box touch at t = "));
  EXPECT_THAT(feasibility_sentence(r), HasSubstr("before the capture, which the plan does not include"));
  EXPECT_THAT(r.warnings, Contains(HasSubstr("approach.plan.clearance keeps bodies apart")));
}

TEST(UnplannedContact, ACaptureInSpiteOfAContactIsFeasibleAndSaysSo) {
  const CaptureResult r = simulate_capture(problem_of(early_contact(0.5)));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.plan->contacts.at(0).disturbs);
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
  EXPECT_THAT(feasibility_sentence(r), HasSubstr("the targets are captured all the same"));
  EXPECT_THAT(r.warnings, Contains(HasSubstr("arm and box at t = ")));
}

// If all pairs may touch, nothing is left to check; the verdict names the contact nevertheless.
TEST(UnplannedContact, AnUncheckedVerdictNamesTheContactToo) {
  std::string text = early_contact(0.5);
  const std::string pairs = "pairs: [[arm, box]]";
  text.replace(text.find(pairs), pairs.size(), "all: true");
  const CaptureResult r = simulate_capture(problem_of(text));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_EQ(r.ledger.feasibility(), Verdict::not_checked);
  EXPECT_THAT(feasibility_sentence(r),
              HasSubstr("feasible: not checked; there is nothing to check; arm and box touch"));
}

// --- Pairs that a plan keeps apart

std::string planar(const std::string& rest, const std::string& plan) {
  return "schema: grapnel-scenario/1\n"
         "name: planar\n"
         "robot: " GRAPNEL_SOURCE_DIR
         "/robots/planar-dual-arm.yaml\n"
         "initial: {joints: [0.698, -1.571, 1.047, 2.444, 1.571, -1.047]}\n"
         "targets:\n"
         "  - name: debris\n"
         "    mass: 10\n"
         "    inertia: [1, 1, 1]\n"
         "    geometry: {shape: sphere, radius: 0.5}\n"
         "    state: {at: capture, position: [2, -2, 0], angular_velocity: [0, 0, 0.2]}\n"
         "    grasp_points: [{name: grip, position: [0, 0.5, 0]}]\n"
         "grasps: [{end_effector: tip-1, target: debris, point: grip}]\n"
         "materials: [{name: pad, stiffness: 2e4, damping: 50, friction: 0.3}]\n"
         "approach: {duration: 20, profile: quintic, plan: {" +
         plan + "}}\nimpact: {}\n" + rest;
}

// Pairs that may touch keep the clearance as if they might not; `contacts: allowed` excludes them.
TEST(PlannedContacts, PairsThatMayTouchAreKeptApart) {
  const std::string all = "contacts: {all: true, material: pad}\n",
                    apart = "clearance: 0.6, near_grasp: 1.2, knots: 0, idle_joints: held";
  const auto plan_with = [](const std::string& text) {
    const CaptureProblem p = problem_of(text);
    return plan_approach(p, plan_targets(p));
  };
  const ApproachPlan plain = plan_with(planar("", apart)), touching = plan_with(planar(all, apart));
  ASSERT_TRUE(plain.failure.empty()) << plain.failure;
  ASSERT_TRUE(touching.failure.empty()) << touching.failure;
  EXPECT_EQ(touching.report.final_position, plain.report.final_position);
  EXPECT_GE(touching.report.path->clearance.value(), 0.6 - 1e-6);
  const ApproachPlan allowed = plan_with(planar(all, apart + ", contacts: allowed"));
  EXPECT_THAT(allowed.failure, HasSubstr("approach.plan.contacts: allowed excludes all pairs"));
}

// An arm that can only slide towards the box does not pass a post or a wall before it.
TEST(PlannedContacts, LinksAreKeptApartFromObstacles) {
  for (const std::string obstacle : {"geometry: {shape: box, size: [0.05, 0.2, 0.2]}, position: [1.5, 0, 0]",
                                     "half_space: true, position: [1.5, 0, 0], rpy: [0, -1.5707963267948966, 0]"}) {
    SCOPED_TRACE(obstacle);
    const std::string obstacles = "obstacles: [{name: post, " + obstacle + "}]\n";
    const CaptureProblem p =
        problem_of(sliding("{at: start, position: [2, 0, 0]}", obstacles + approach("plan: {clearance: 0.05}")));
    EXPECT_THAT(plan_approach(p, plan_targets(p)).failure, HasSubstr("'arm' and 'post'"));
  }
  const CaptureProblem behind = problem_of(
      sliding("{at: start, position: [2, 0, 0]}",
              "obstacles: [{name: post, half_space: true, position: [2.3, 0, 0], rpy: [0, -1.5707963267948966, 0]}]\n" +
                  approach("plan: {clearance: 0.05}")));
  const ApproachPlan plan = plan_approach(behind, plan_targets(behind));
  EXPECT_TRUE(plan.failure.empty()) << plan.failure;
}

}  // namespace contact_plan_test
}  // namespace grapnel::testing
