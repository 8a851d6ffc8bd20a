/// Grasps that close while hard bodies touch: both take part in one impact.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "capture/scenario_run.hpp"

namespace grapnel::testing {
namespace hard_grasp_test {

// A base of 100 kg with a slide of 5 kg moves at 0.1 m/s along x and grasps a box of 20 kg, which lies on a wall.
std::string scene(const std::string& material, const std::string& impact, const std::string& target = "box",
                  const std::string& more = "", const std::string& closes = "") {
  std::string robot = sliding_arm();
  const std::string joints = "initial: {joints: [0]}";
  robot.replace(robot.find(joints), joints.size(),
                more.empty() ? "initial: {base: {velocity: [0.1, 0, 0]}, joints: [0]}"
                             : "initial: {base: {position: [-0.1, 0, 0]}, joints: [0]}");
  const std::string box =
      "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]},\n"
      "     state: {at: start, position: [1, 0, 0]}, grasp_points: [{name: face, position: [-0.2, 0, 0]}]}\n";
  const std::string ball =
      "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: sphere, radius: 0.2},\n"
      "     state: {at: start, position: [1, 0.05, 0]}, grasp_points: [{name: face, position: [-0.2, -0.05, 0]}]}\n";
  return "schema: grapnel-scenario/1\nname: pressed\n" + robot + "targets:\n" + (target == "box" ? box : ball) +
         "obstacles: [{name: wall, half_space: true, position: [1.2, 0, 0], rpy: [0, -90 deg, 0]}]\n"
         "materials:\n  - {name: pad, " +
         material + "}\ncontacts: {pairs: [[box, wall]], material: pad}\n" + more +
         "grasps: [{end_effector: tip, target: box, point: face" + closes + "}]\nimpact: {" + impact +
         "}\npost_impact: {duration: " + (more.empty() ? "0.5" : "2.3") +
         ", joints: " + (impact.find("free") == std::string::npos ? "braked" : "free") + "}\n";
}
const std::string kHard = "stiffness: 1e5, hard: true, restitution: 0.5, friction: 0.3";

// Robot and box first move together, and rebound from the wall in the same instant.
TEST(HardGrasp, ABoxOnAWallIsGrasped) {
  for (const bool braked : {true, false}) {
    SCOPED_TRACE(braked);
    const CaptureResult r = run(scene(kHard, braked ? "law: plastic, joints: braked" : "law: plastic, joints: free"));
    expect_sound(r);
    const double arm = braked ? 105 : 5, all = arm + 20, together = arm * 0.1 / all, impulse = 1.5 * all * together;
    ASSERT_TRUE(r.impact());
    const ImpactReport& impact = *r.impact();
    ASSERT_EQ(impact.hard_contacts.size(), 1u);
    const HardContactImpulse& wall = impact.hard_contacts[0];
    EXPECT_EQ(wall.body_a == "box" ? wall.body_b : wall.body_a, "wall");
    EXPECT_EQ(wall.points, 4);
    EXPECT_NEAR(wall.normal_impulse, impulse, 1e-11);
    EXPECT_NEAR(norm(wall.impulse), impulse, 1e-11);
    EXPECT_NEAR(wall.approach_speed, 0, 1e-12);
    EXPECT_NEAR(wall.restitution_loss, 0.5 * all * together * together * 0.75, 1e-12);
    EXPECT_NEAR(wall.friction_loss, 0, 1e-12);
    EXPECT_NEAR(impact.targets_after[0].velocity[0], -0.5 * together, 1e-12);
    EXPECT_NEAR(impact.grasps[0].impulse[0], -arm * (0.1 + 0.5 * together), 1e-11);
    EXPECT_NEAR(impact.kinetic_energy_after, 0.5 * all * 0.25 * together * together + (braked ? 0 : 0.5 * 100 * 0.01),
                1e-12);
    const ContactPairReport& contact = pair_of(r, "box", "wall");
    ASSERT_TRUE(contact.hard);
    EXPECT_EQ(contact.hard->impacts, 1);
    EXPECT_EQ(contact.hard->last_time, 0.0);
    EXPECT_NEAR(contact.hard->impulse, impulse, 1e-11);
    EXPECT_NEAR(contact.impulse, impulse, 1e-11);
    EXPECT_EQ(contact.touches, 1);
    EXPECT_EQ(contact.peak_force, 0);
    EXPECT_NEAR(r.post_impact_end->targets[0].velocity[0], -0.5 * together, 1e-11);
  }
}

// The box rests on the wall in lasting contact, pressed by gravity, in which the robot falls towards it for 2 s.
TEST(HardGrasp, ABoxInLastingContactIsGrasped) {
  const CaptureResult r =
      run(scene(kHard, "law: plastic, joints: braked", "box", "gravity: [0.05, 0, 0]\n", ", closes_at: 2"));
  expect_sound(r);
  ASSERT_TRUE(r.impact());
  ASSERT_EQ(r.impact()->hard_contacts.size(), 1u);
  EXPECT_NEAR(r.impact()->time, 2, 1e-9);
  // The box vibrates slightly on the elastic wall.
  EXPECT_NEAR(r.impact()->hard_contacts[0].normal_impulse, 15.75, 1e-2);
  EXPECT_NEAR(r.impact()->targets_after[0].velocity[0], -0.042, 1e-4);
  const ContactPairReport& contact = pair_of(r, "box", "wall");
  EXPECT_EQ(contact.hard->impacts, 1);
  EXPECT_TRUE(contact.hard->persistent_since);
  EXPECT_GT(contact.impulse, 15.75 + 20 * 0.05 * 1.9);
}

// Without losses the impact is the limit of elastic contacts with growing stiffness, which push after the grasp.
TEST(HardGrasp, IsTheLimitOfStiffContacts) {
  const auto final_velocity = [](const std::string& material) {
    const CaptureResult r = run(scene(material, "law: plastic, joints: braked", "ball"));
    expect_sound(r);
    return r.post_impact_end ? r.post_impact_end->targets[0].angular_velocity[2] : std::nan("");
  };
  const double hard = final_velocity("stiffness: 1e5, hard: true, restitution: 1");
  ASSERT_GT(std::abs(hard), 1e-3);
  double last = 0;
  for (const char* stiffness : {"1e5", "1e7", "1e9"}) {
    const double off = std::abs(final_velocity(std::string("stiffness: ") + stiffness) - hard) / std::abs(hard);
    std::printf("[ measured ] stiffness %s: off by %.3g\n", stiffness, off);
    if (last > 0) {
      EXPECT_LT(off, 0.3 * last);
    }
    last = off;
  }
  EXPECT_LT(last, 1e-3);
}

// A contact that rebounds pushes the box on the wall in the same impact; under Newton's hypothesis, too.
TEST(HardGrasp, AContactPushesABoxOnAWall) {
  for (const char* hypothesis : {"stronge", "newton", "poisson"}) {
    SCOPED_TRACE(hypothesis);
    std::string text =
        scene(kHard, std::string("law: restitution, restitution: 0.4, hypothesis: ") + hypothesis + ", joints: braked");
    const std::string keys = "point: face", point = "name: face, position: [-0.2, 0, 0]";
    text.replace(text.find(keys), keys.size(), "point: face, model: contact");
    text.replace(text.find(point), point.size(), point + ", normal: [-1, 0, 0]");
    const CaptureResult r = run(text);
    expect_sound(r);
    ASSERT_TRUE(r.impact());
    ASSERT_EQ(r.impact()->hard_contacts.size(), 1u);
    EXPECT_GT(r.impact()->hard_contacts[0].normal_impulse, 0.1);
    // Momentum of the box: the robot pushes it to the wall, which pushes it back.
    const double box = 20 * r.impact()->targets_after[0].velocity[0];
    EXPECT_NEAR(box, -r.impact()->grasps[0].impulse[0] - r.impact()->hard_contacts[0].normal_impulse, 1e-11);
    EXPECT_LE(box, 1e-12);
    EXPECT_LT(r.impact()->kinetic_energy_after, r.impact()->kinetic_energy_before);
  }
}

// Brakes that lock the slide push the held box on the wall.
TEST(HardGrasp, BrakesPushAHeldBoxOnAWall) {
  std::string text = scene(kHard, "law: plastic, joints: free");
  text.replace(text.find("joints: free}\n", text.find("post_impact")), 14, "joints: braked}\n");
  const CaptureResult r = run(text);
  expect_sound(r);
  ASSERT_TRUE(r.impact() && r.impact()->brake);
  // The grasp's impact leaves arm and box at -0.01 m/s; the brake lets the base, at 0.1 m/s, push them back.
  const double together = (100 * 0.1 - 25 * 0.01) / 125;
  const ContactPairReport& contact = pair_of(r, "box", "wall");
  EXPECT_EQ(contact.hard->impacts, 2);
  EXPECT_NEAR(contact.hard->impulse, 1.5 * 25 * 0.02 + 1.5 * 125 * together, 1e-10);
  EXPECT_NEAR(r.post_impact_end->targets[0].velocity[0], -0.5 * together, 1e-11);
}

}  // namespace hard_grasp_test
}  // namespace grapnel::testing
