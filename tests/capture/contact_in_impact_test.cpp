/// Contacts between shapes in runs with impacts of grasps: compliant impacts, in which they act, and instantaneous
/// ones.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "capture/scenario_run.hpp"

namespace grapnel::testing {
namespace contact_in_impact_test {

std::string exact(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.17g", x);
  return text.data();
}

// A base with an arm, whose tip grasps a box; a ball flies towards a wall with a spin. At the start the box moves away
// from the tip, so that the impact begins. `gap`: of the ball and the wall [m].
std::string scene(double gap, const std::string& rest, const std::string& material = "damping: 20, friction: 0.3",
                  const std::string& pairs = "[ball, wall]") {
  return "schema: grapnel-scenario/1\n"
         "name: touching\n" +
         sliding_arm() +
         "targets:\n"
         "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]},\n"
         "     state: {position: [1, 0, 0], velocity: [0.03, 0.01, 0], angular_velocity: [0, 0, 0.02]},\n"
         "     grasp_points: [{name: face, position: [-0.2, 0, 0]}]}\n"
         "  - {name: ball, mass: 5, inertia: [0.02, 0.02, 0.02], geometry: {shape: sphere, radius: 0.1},\n"
         "     state: {position: [" +
         exact(3 - 0.1 - gap) +
         ", 2, 0], velocity: [0.1, 0.02, 0], angular_velocity: [0, 0, 0.5]}}\n"
         "obstacles: [{name: wall, half_space: true, position: [3, 0, 0], rpy: [0, -1.5707963267948966, 0]}]\n"
         "materials:\n  - {name: pad, stiffness: 2e4, " +
         material + "}\ncontacts: {pairs: [" + pairs + "], material: pad}\n" + rest;
}
const std::string kCompliant =
    "grasps: [{end_effector: tip, target: box, point: face}]\n"
    "impact: {law: compliant, grasp: {linear_stiffness: 1e4, linear_damping: 300, angular_stiffness: 1e3, "
    "angular_damping: 30}}\n"
    "post_impact: {duration: 2, joints: free}\n";

// The ball rebounds from the wall in the impact of the grasp, at its end and after it, as it does without a grasp.
TEST(ContactInImpact, ABodyThatIsNotGraspedReboundsAsWithoutTheImpact) {
  const CaptureResult first = run(scene(1, kCompliant));
  expect_sound(first);
  const double duration = first.impact()->duration;
  ASSERT_GT(duration, 0.1);
  for (const double touch : {0.5 * duration, duration - 0.02, duration + 0.1}) {
    SCOPED_TRACE(touch / duration);
    const CaptureResult r = run(scene(0.1 * touch, kCompliant));
    expect_sound(r);
    EXPECT_NEAR(r.impact()->duration, duration, 1e-7);
    const CaptureResult alone = run(scene(0.1 * touch, "motion: {duration: 2, joints: free}\n"));
    expect_sound(alone);
    const ContactPairReport &with = pair_of(r, "ball", "wall"), &without = pair_of(alone, "ball", "wall");
    EXPECT_EQ(with.touches, 1);
    EXPECT_NEAR(with.first_time.value(), touch, 1e-9);
    EXPECT_NEAR(with.duration, without.duration, 1e-8);
    EXPECT_NEAR(with.impulse, without.impulse, 1e-7 * without.impulse);
    EXPECT_NEAR(with.damping_loss, without.damping_loss, 1e-6 * without.damping_loss);
    EXPECT_NEAR(with.friction_loss, without.friction_loss, 1e-6 * without.friction_loss);
    EXPECT_NEAR(with.largest_depth, without.largest_depth, 1e-6 * without.largest_depth);  // measured 3e-8
    EXPECT_NEAR(with.peak_force, without.peak_force, 1e-6 * without.peak_force);           // measured 2e-7
  }
}

// The grasp closes while the ball is pressed on the wall and rubs: its contact continues in the impact.
TEST(ContactInImpact, ABodyInContactAtItsBeginningReboundsAsWithoutTheImpact) {
  std::string late = kCompliant;
  late.insert(late.find("point: face") + 11, ", closes_at: 0.22");
  const CaptureResult r = run(scene(0.02, late)), alone = run(scene(0.02, "motion: {duration: 2, joints: free}\n"));
  expect_sound(r), expect_sound(alone);
  EXPECT_NEAR(r.impact()->time, 0.22, 1e-12);
  const ContactPairReport &with = pair_of(r, "ball", "wall"), &without = pair_of(alone, "ball", "wall");
  ASSERT_LT(with.first_time.value(), 0.22);
  EXPECT_EQ(with.touches, 1);
  EXPECT_NEAR(with.duration, without.duration, 1e-8);
  EXPECT_NEAR(with.impulse, without.impulse, 1e-7 * without.impulse);
  EXPECT_NEAR(with.damping_loss, without.damping_loss, 1e-6 * without.damping_loss);
  EXPECT_NEAR(with.friction_loss, without.friction_loss, 1e-6 * without.friction_loss);
  EXPECT_GT(with.peak_time, 0.22);
}

// The grasped box moves on and presses on a bumper, which it would pass through without contacts in the impact.
TEST(ContactInImpact, TheGraspedTargetPressesOnAnotherBody) {
  const std::string bumper =
      "obstacles: [{name: bumper, geometry: {shape: sphere, radius: 0.05}, position: [1.252, 0.05, 0.02]}]\n";
  std::string text = scene(1, kCompliant, "damping: 20, friction: 0.3", "[box, bumper], [ball, bumper]");
  const std::size_t at = text.find("obstacles:");
  text.replace(at, text.find('\n', at) + 1 - at, bumper);
  const CaptureResult r = run(text);
  expect_sound(r);
  const ContactPairReport& contact = pair_of(r, "box", "bumper");
  EXPECT_GE(contact.touches, 1);
  EXPECT_LT(contact.first_time.value(), r.impact()->duration);
  EXPECT_GT(contact.impulse, 0.05);
  EXPECT_LT(contact.largest_depth, 2e-3);
  EXPECT_FALSE(contact.beyond_model);
  // The time series shows the force within the impact.
  double force = 0;
  for (const Series& s : r.series.series) {
    if (s.path != "contacts/box--bumper/normal_force") continue;
    for (std::size_t i = 0; i < s.data.size() && r.series.time[i] < r.impact()->duration; ++i)
      force = std::max(force, s.data[i]);
  }
  EXPECT_NEAR(force, contact.peak_force, 0.1 * contact.peak_force);
}

// Forces of compliant contacts are finite, so none acts in the instant of a rigid impact, in which the ball touches the
// wall: it keeps its velocity towards the wall, and rebounds afterwards.
TEST(ContactInImpact, ACompliantContactTransmitsNoImpulseInAnInstant) {
  std::string rigid = kCompliant;
  rigid.replace(rigid.find("law: compliant"), rigid.find("}}") + 2 - rigid.find("law: compliant"), "law: plastic}");
  const CaptureResult apart = run(scene(1, rigid)), touching = run(scene(0, rigid));
  expect_sound(apart), expect_sound(touching);
  ASSERT_EQ(pair_of(touching, "ball", "wall").touches, 1);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(apart.impact()->targets_after[0].velocity[k], touching.impact()->targets_after[0].velocity[k], 1e-15);
  EXPECT_NEAR(touching.impact()->targets_after[1].velocity[0], 0.1, 1e-15);
}

}  // namespace contact_in_impact_test
}  // namespace grapnel::testing
