/// Contacts between shapes in whole runs: grasps that close and release, overlaps at the start, obstacles, loops.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "capture/scenario_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace contact_run_test {

using ::testing::HasSubstr;

// A base with one arm whose tip is a ball, and a box in front of it that drifts towards the tip.
std::string scene(const std::string& target, const std::string& rest,
                  const std::string& material = "restitution: 0.5") {
  return "schema: grapnel-scenario/1\n"
         "name: touching\n" +
         sliding_arm() +
         "targets:\n"
         "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: " +
         target +
         ", grasp_points: [{name: face, position: [-0.18, 0, 0]}]}\n"
         "materials:\n  - {name: pad, stiffness: 2e4, " +
         material + ", friction: 0.3}\n" + rest;
}
double load(const CaptureResult& r, const std::string& of, const std::string& quantity, const std::string& phase) {
  for (const PeakLoad& l : r.peak_loads) {
    if (l.of == of && l.quantity == quantity && l.phase == phase) return l.peak;
  }
  return 0;
}

TEST(ContactRun, ABoxReboundsFromABrakedArm) {
  const CaptureResult r = run(scene("{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}",
                                    "contacts: {pairs: [[arm, box]], material: pad}\n"
                                    "motion: {duration: 3, joints: braked}\n"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  const ContactPairReport& contact = pair_of(r, "arm", "box");
  EXPECT_EQ(contact.touches, 1);
  EXPECT_FALSE(contact.touches_at_end);
  EXPECT_NEAR(contact.first_time.value(), (1.1 - 0.2 - 0.8) / 0.1, 1e-9);
  // A central impact of 105 and 20 kg with the coefficient 0.5 of the material, stated at this speed.
  const double reduced = 105.0 * 20 / 125;
  EXPECT_NEAR(contact.impulse, reduced * 0.1 * 1.5, 1e-6);
  EXPECT_NEAR(contact.damping_loss, 0.5 * reduced * 0.01 * 0.75, 1e-7);
  EXPECT_GT(contact.peak_force, 0);
  EXPECT_LT(contact.largest_depth, 0.1);
}

// Half a period of a mass on a spring: its peaks lie between the steps.
TEST(ContactRun, PeaksOfAnElasticContactAreExact) {
  const CaptureResult r = run(scene(
      "{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}",
      "contacts: {pairs: [[arm, box]], material: pad}\nmotion: {duration: 3, joints: braked}\n", "restitution: 1"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const ContactPairReport& contact = pair_of(r, "arm", "box");
  const double reduced = 105.0 * 20 / 125, stiffness = 2e4, period = std::sqrt(reduced / stiffness);
  EXPECT_NEAR(contact.peak_force, 0.1 * stiffness * period, 1e-9);
  EXPECT_NEAR(contact.largest_depth, 0.1 * period, 1e-13);
  EXPECT_NEAR(contact.peak_time, contact.first_time.value() + std::acos(0.0) * period, 1e-5);
  EXPECT_NEAR(contact.duration, 2 * std::acos(0.0) * period, 1e-9);
}

TEST(ContactRun, WithoutContactsTheBoxPassesThrough) {
  const CaptureResult r = run(
      scene("{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}", "motion: {duration: 3, joints: braked}\n"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.contacts.empty());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::no);
}

TEST(ContactRun, OverlapsAtTheStartEndItWithTheirDepths) {
  const CaptureResult r = run(scene("{at: start, position: [0.99, 0, 0]}",
                                    "contacts: {pairs: [[arm, box]], material: pad}\n"
                                    "motion: {duration: 3, joints: braked}\n"));
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, HasSubstr("arm and box overlap by 0.01 m"));
}

TEST(ContactRun, ABoxFallsOnAnObstacleAndRests) {
  const CaptureResult r = run(scene("{at: start, position: [3, 0, 0.1], angular_velocity: [0.1, 0.2, 0.3]}",
                                    "gravity: [0, 0, -1]\n"
                                    "obstacles: [{name: floor, half_space: true, position: [0, 0, -0.15]}]\n"
                                    "contacts: {pairs: [[box, floor]], material: pad}\n"
                                    "motion: {duration: 20, joints: braked}\n",
                                    "damping: 200"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_TRUE(pair_of(r, "box", "floor").touches_at_end);
  ASSERT_TRUE(r.post_impact_end);
  EXPECT_LT(norm(r.post_impact_end->targets[0].velocity), 1e-7);          // measured 6e-9
  EXPECT_LT(norm(r.post_impact_end->targets[0].angular_velocity), 1e-7);  // measured 3e-8
}

// A rigid grasp closes while the ball of the gripper overlaps the box: no force acts while it holds, nor after the
// release until both are apart.
TEST(ContactRun, AGripperPassesThroughItsTargetUntilTheyAreApart) {
  const CaptureResult r = run(scene("{position: [0.98, 0, 0], velocity: [-0.02, 0, 0]}",
                                    "contacts: {pairs: [[arm, box]], material: pad}\n"
                                    "grasps: [{end_effector: tip, target: box, point: face}]\n"
                                    "impact: {law: plastic}\n"
                                    "post_impact: {duration: 4, joints: braked, release: [{after: 2}]}\n"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_EQ(pair_of(r, "arm", "box").peak_force, 0);
}

// ---- Hard contacts ----

// The box strikes the arm's ball: a central impact in an instant, of 105 and 20 kg, or with a free joint of 5 and 20
// kg.
TEST(HardContactRun, ABoxReboundsInAnInstant) {
  for (const bool braked : {true, false}) {
    SCOPED_TRACE(braked);
    const CaptureResult r = run(scene("{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}",
                                      "contacts: {pairs: [[arm, box]], material: pad}\n"
                                      "motion: {duration: 3, joints: " +
                                          std::string(braked ? "braked" : "free") + "}\n",
                                      "hard: true, restitution: 0.5"));
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    EXPECT_TRUE(r.ledger.pass());
    const ContactPairReport& contact = pair_of(r, "arm", "box");
    ASSERT_TRUE(contact.hard);
    EXPECT_EQ(contact.hard->impacts, 1);
    EXPECT_EQ(contact.touches, 1);
    const double arm = braked ? 105 : 5, reduced = arm * 20 / (arm + 20);
    EXPECT_NEAR(contact.hard->impulse, reduced * 0.1 * 1.5, 1e-12);
    EXPECT_EQ(contact.impulse, contact.hard->impulse);
    EXPECT_NEAR(contact.hard->restitution_loss, 0.5 * reduced * 0.01 * 0.75, 1e-13);
    EXPECT_NEAR(contact.hard->friction_loss, 0, 1e-13);
    EXPECT_NEAR(contact.first_time.value(), 1, 1e-10);
    EXPECT_EQ(contact.hard->last_time, contact.first_time);
    EXPECT_NEAR(contact.hard->fastest_impact, 0.1, 1e-12);
    EXPECT_FALSE(contact.hard->persistent_since);
    EXPECT_EQ(contact.peak_force, 0);
    EXPECT_NEAR(r.post_impact_end->targets[0].velocity[0], -0.1 + reduced * 0.15 / 20, 1e-12);
    // The brake moves the base with the arm; a free joint transmits nothing along its axis.
    const double through = braked ? contact.hard->impulse * 100 / 105 : 0;
    EXPECT_NEAR(load(r, "slide", "impulse", "motion"), through, 1e-12);
    EXPECT_NEAR(load(r, "slide", "driving_impulse", "motion"), through, 1e-12);
    EXPECT_NEAR(load(r, "slide", "angular_impulse", "motion"), 0, 1e-12);
  }
}

TEST(HardContactRun, ABoxBouncesUntilItRests) {
  const CaptureResult r = run(scene("{at: start, position: [3, 0, 0.1], angular_velocity: [0.1, 0.2, 0.3]}",
                                    "gravity: [0, 0, -1]\n"
                                    "obstacles: [{name: floor, half_space: true, position: [0, 0, -0.15]}]\n"
                                    "contacts: {pairs: [[box, floor]], material: pad}\n"
                                    "motion: {duration: 10, joints: braked}\n",
                                    "hard: true, restitution: 0.4"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  const ContactPairReport& contact = pair_of(r, "box", "floor");
  ASSERT_TRUE(contact.hard);
  EXPECT_GT(contact.hard->impacts, 3);
  EXPECT_TRUE(contact.hard->persistent_since);
  EXPECT_TRUE(contact.touches_at_end);
  EXPECT_GT(contact.hard->restitution_loss, 0);
  EXPECT_GT(contact.hard->friction_loss, 0);
  EXPECT_LT(norm(r.post_impact_end->targets[0].velocity), 1e-6);
  EXPECT_LT(norm(r.post_impact_end->targets[0].angular_velocity), 1e-6);
}

// Three boxes fall on each other: impacts of several pairs and points simultaneously, and contact that lasts.
TEST(HardContactRun, BoxesPileUp) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult r =
      run("schema: grapnel-scenario/1\n"
          "name: pile\n"
          "robot: {name: r, base: {name: base, mass: 100, inertia: [10, 10, 10], geometry: {shape: box, size: [1, 1, "
          "0.2]}}}\n"
          "targets:\n"
          "  - {name: large, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: {at: "
          "start, "
          "position: [0.1, 0, 0.6], rpy: [0.2, 0.3, 0.1], velocity: [0, 0, -0.1]}}\n"
          "  - {name: small, mass: 10, inertia: [0.5, 0.5, 0.5], geometry: {shape: box, size: [0.3, 0.3, 0.3]}, state: "
          "{at: "
          "start, position: [0, 0, 1.3], rpy: [0.5, 0.3, 0.1], velocity: [0, 0, -0.3]}}\n"
          "gravity: [0, 0, -0.3]\n"
          "obstacles: [{name: floor, half_space: true, position: [0, 0, -0.3]}]\n"
          "materials: [{name: pad, stiffness: 1e5, hard: true, restitution: 0.3, friction: 0.5}]\n"
          "contacts: {all: true, material: pad}\n"
          "motion: {duration: 1.74}\n");
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_GT(pair_of(r, "base", "floor").hard->impacts, 5);
  EXPECT_GT(pair_of(r, "base", "large").hard->impacts, 2);
  EXPECT_TRUE(pair_of(r, "base", "floor").hard->persistent_since);
}

// A held box meets a wall: each joint and grasp transmits the change of momentum of the bodies behind it.
TEST(HardContactRun, LoadsOfJointsAndGraspsIncludeItsImpulses) {
  std::string text = scene("{position: [0.98, 0, 0], velocity: [0.1, 0, 0]}",
                           "obstacles: [{name: wall, half_space: true, position: [1.3, 0, 0], rpy: [0, -90 deg, 0]}]\n"
                           "contacts: {pairs: [[box, wall]], material: pad}\n"
                           "grasps: [{end_effector: tip, target: box, point: face}]\n"
                           "impact: {law: plastic, joints: braked}\n"
                           "post_impact: {duration: 2, joints: braked}\n",
                           "hard: true, restitution: 0.5");
  const std::string joints = "initial: {joints: [0]}";
  text.replace(text.find(joints), joints.size(), "initial: {base: {velocity: [0.1, 0, 0]}, joints: [0]}");
  const CaptureResult r = run(text);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const double impulse = 125 * 0.1 * 1.5;
  EXPECT_NEAR(pair_of(r, "box", "wall").hard->impulse, impulse, 1e-11);
  EXPECT_NEAR(load(r, "tip", "impulse", "post_impact"), impulse * 105 / 125, 1e-11);
  EXPECT_NEAR(load(r, "slide", "impulse", "post_impact"), impulse * 100 / 125, 1e-11);
  EXPECT_NEAR(load(r, "slide", "driving_impulse", "post_impact"), impulse * 100 / 125, 1e-11);
  EXPECT_NEAR(load(r, "tip", "angular_impulse", "post_impact"), 0, 1e-11);
}

// Two slides hold a box by two grasps; each transmits the change of momentum of its link, one of them as a closure.
TEST(HardContactRun, LoadsOfGraspsOfALoopIncludeItsImpulses) {
  const auto link = [](const std::string& name, const std::string& y) {
    return "    - {name: " + name + ", parent: base, mass: 5, inertia: [0.1, 0.1, 0.1], joint: {name: slide-" + name +
           ", type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, " + y + ", 0]}}}\n";
  };
  const CaptureResult r = run(
      "schema: grapnel-scenario/1\nname: loop\nrobot:\n  name: r\n"
      "  base: {name: base, mass: 100, inertia: [20, 20, 20]}\n  links:\n" +
      link("left", "0.3") + link("right", "-0.3") +
      "  end_effectors: [{name: tip-1, link: left, position: [0.3, 0, 0]}, {name: tip-2, link: right, position: "
      "[0.3, 0, 0]}]\n"
      "initial: {base: {velocity: [0.1, 0, 0]}, joints: [0, 0]}\n"
      "targets:\n"
      "  - name: box\n    mass: 20\n    inertia: [1, 1, 1]\n    geometry: {shape: box, size: [0.4, 0.8, 0.4]}\n"
      "    state: {position: [1, 0, 0], velocity: [0.1, 0, 0]}\n"
      "    grasp_points: [{name: left, position: [-0.2, 0.3, 0]}, {name: right, position: [-0.2, -0.3, 0]}]\n"
      "grasps: [{end_effector: tip-1, target: box, point: left}, {end_effector: tip-2, target: box, point: right}]\n"
      "obstacles: [{name: wall, half_space: true, position: [1.27, 0, 0], rpy: [0, -90 deg, 0]}]\n"
      "materials: [{name: shell, stiffness: 1e5, hard: true, restitution: 0.5}]\n"
      "contacts: {pairs: [[box, wall]], material: shell}\n"
      "impact: {law: plastic, joints: free}\npost_impact: {duration: 1, joints: free}\n");
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const double impulse = 30 * 0.1 * 1.5;
  EXPECT_NEAR(pair_of(r, "box", "wall").hard->impulse, impulse, 1e-11);
  for (const char* tip : {"tip-1", "tip-2"})
    EXPECT_NEAR(load(r, tip, "impulse", "post_impact"), impulse * 5 / 30, 1e-11) << tip;
  EXPECT_NEAR(load(r, "slide-left", "driving_impulse", "post_impact"), 0, 1e-11);
  EXPECT_NEAR(load(r, "slide-right", "driving_impulse", "post_impact"), 0, 1e-11);
}

// impact.joints applies to hard contacts: a driven arm is as heavy as its base. The grasp is too late to close.
TEST(HardContactRun, JointsAreAsInImpacts) {
  std::string text = scene("{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}",
                           "contacts: {pairs: [[arm, box]], material: pad}\n"
                           "grasps: [{end_effector: tip, target: box, point: face, closes_at: 2.5}]\n"
                           "impact: {law: plastic, joints: driven}\n"
                           "post_impact: {duration: 3, joints: free}\n",
                           "hard: true, restitution: 0.5");
  const std::string tip = "position: [0.3, 0, 0]}";
  text.replace(text.find(tip), tip.size(), "position: [0.3, 0, 0], envelope: {position: 1e-3}}");
  const CaptureResult r = run(text);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_NEAR(pair_of(r, "arm", "box").hard->impulse, 105.0 * 20 / 125 * 0.1 * 1.5, 1e-12);
}

// With a compliant surface the contact is compliant.
TEST(HardContactRun, ACompliantSurfaceDecides) {
  const std::string rest =
      "  - {name: soft, stiffness: 2e4}\ncontacts: {pairs: [[arm, box]], materials: [soft, pad]}\n"
      "motion: {duration: 3, joints: braked}\n";
  std::string text =
      scene("{at: start, position: [1.1, 0, 0], velocity: [-0.1, 0, 0]}", rest, "hard: true, restitution: 0.5");
  const CaptureResult r = run(text);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const ContactPairReport& contact = pair_of(r, "arm", "box");
  EXPECT_FALSE(contact.hard);
  EXPECT_EQ(contact.touches, 1);
  EXPECT_GT(contact.peak_force, 0);
}

}  // namespace contact_run_test
}  // namespace grapnel::testing
