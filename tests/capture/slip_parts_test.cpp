/// Grasps of which force and moment slip separately, points and hinges that slip, and impacts while a grasp slips:
/// closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "capture/slipping_box.hpp"

namespace grapnel::testing {
namespace slip_parts_test {

using namespace held_box;

const BodyMotion& box(const CaptureResult& r) { return r.post_impact_end->targets.at(0); }

// --- Separate limits ---

// Both parts begin at the jump of the load; the rotation comes to rest first, and the displacement continues.
TEST(SlipParts, ForceAndMomentSlideIndependently) {
  const CaptureResult r = run(scene(
      "holds: {force: 4, moment: 0.5, combined: components, beyond: slips, kinetic_ratio: 0.9}", pulse(50, 10), 6));
  expect_sound(r);
  const Slide along = slide(50, 3.6), about = turn(10, 0.45);
  ASSERT_EQ(r.slips.size(), 1u);
  ASSERT_LT(about.until(), along.until() - 0.1);
  EXPECT_NEAR(r.slips[0].time, 1, 1e-12);
  EXPECT_NEAR(r.slips[0].until, along.until(), 1e-5);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  EXPECT_NEAR(r.slips[0].distance, along.distance(), 1e-7);
  EXPECT_NEAR(r.slips[0].angle, about.distance(), 1e-7);
  EXPECT_NEAR(r.slips[0].energy, 3.6 * along.distance() + 0.45 * about.distance(), 1e-6);
  EXPECT_NEAR(r.grasps[0].slip_angle, about.distance(), 1e-7);
  EXPECT_NEAR(box(r).velocity[0], 50 / kAll, 1e-9);
  EXPECT_NEAR(box(r).angular_velocity[0], 10 / kTurn, 1e-9);
}

TEST(SlipParts, TheDisplacementComesToRestBeforeTheRotation) {
  const CaptureResult r =
      run(scene("holds: {force: 4, moment: 0.5, combined: components, beyond: slips}", pulse(30, 12), 6));
  expect_sound(r);
  const Slide along = slide(30, 4), about = turn(12, 0.5);
  ASSERT_EQ(r.slips.size(), 1u);
  ASSERT_LT(along.until(), about.until() - 0.1);
  EXPECT_NEAR(r.slips[0].until, about.until(), 1e-5);
  EXPECT_NEAR(r.slips[0].distance, along.distance(), 1e-7);
  EXPECT_NEAR(r.slips[0].angle, about.distance(), 1e-7);
}

TEST(SlipParts, AMomentBelowItsLimitIsHeldWhileTheForceSlips) {
  const CaptureResult r =
      run(scene("holds: {force: 4, moment: 0.5, combined: components, beyond: slips}", pulse(50, 2), 6));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].distance, slide(50, 4).distance(), 1e-7);
  EXPECT_NEAR(r.slips[0].angle, 0, 1e-12);
  EXPECT_NEAR(box(r).angular_velocity[0], 2 / kTurn, 1e-10);
}

// Under ramps the force reaches its limit first, and the moment while the force slips.
TEST(SlipParts, TheMomentBeginsWhileTheForceSlips) {
  const CaptureResult r = run(scene("holds: {force: 4, moment: 2, combined: components, beyond: slips}",
                                    pushed("[0, 0, 0, 0, 0, 0, 0], [10, 100, 0, 0, 60, 0, 0]"), 5));
  expect_sound(r);
  const double force_onset = 4 / (10 * kBox / kAll), moment_onset = 2 * kTurn / 6;
  ASSERT_LT(force_onset, moment_onset);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].time, force_onset, 1e-9);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::slips);
  EXPECT_NEAR(r.slips[0].distance, 10 / kServicer * std::pow(5 - force_onset, 3) / 6, 1e-7);
  EXPECT_NEAR(r.slips[0].angle, 6 / kServicerTurn * std::pow(5 - moment_onset, 3) / 6, 1e-7);
}

// Reversed loads reverse both parts, at different times.
TEST(SlipParts, ReversedLoadsReverseEachPart) {
  const std::string loads =
      "external_wrenches:\n"
      "  - {body: base, force: [50, 0, 0], torque: [10, 0, 0], time: {shape: constant, start: 1, end: 2}}\n"
      "  - {body: base, force: [-50, 0, 0], torque: [-8, 0, 0], time: {shape: constant, start: 2, end: 4}}\n";
  const CaptureResult r = run(scene("holds: {force: 4, moment: 0.5, combined: components, beyond: slips}", loads, 10));
  expect_sound(r);
  // Relative rate under loads a, then -b, with friction f: up with a - f, down with b + f, back with b - f, and to
  // rest.
  struct Reversal {
    double path, net, end;
  };
  const auto reversal = [](double a, double b, double f) {
    const double peak = a - f, turn = 2 + peak / (b + f), back = (b - f) * (4 - turn), end = 4 + back / f;
    const double there = 0.5 * peak * (turn - 1), return_way = 0.5 * back * (end - turn);
    return Reversal{there + return_way, std::abs(there - return_way), end};
  };
  const Reversal along = reversal(50 / kServicer, 50 / kServicer, 4 / kReduced);
  const Reversal about = reversal(10 / kServicerTurn, 8 / kServicerTurn, 0.5 / kReducedTurn);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].until, std::max(along.end, about.end), 1e-4);
  EXPECT_NEAR(r.slips[0].distance, along.path, 1e-5);
  EXPECT_NEAR(r.slips[0].angle, about.path, 1e-5);
  EXPECT_NEAR(r.grasps[0].slip_distance, along.net, 1e-5);
  EXPECT_NEAR(r.grasps[0].slip_angle, about.net, 1e-5);
}

// Under loads in all directions the parts dissipate the products of their limits and paths.
TEST(SlipParts, SlipInSpaceDissipatesLimitsTimesPaths) {
  const CaptureResult r = run(scene(
      "holds: {force: 4, moment: 0.5, combined: components, beyond: slips, kinetic_ratio: 0.8}",
      pushed("[0, 0, 0, 0, 0, 0, 0], [1, 5, 30, 20, 6, 4, 3], [2, -5, -20, 30, -6, 4, -3], [3, 0, 0, 0, 0, 0, 0]"), 6));
  expect_sound(r);
  ASSERT_FALSE(r.slips.empty());
  double energy = 0, expected = 0;
  for (const SlipReport& slip : r.slips) {
    energy += slip.energy;
    expected += 0.8 * (4 * slip.distance + 0.5 * slip.angle);
  }
  EXPECT_GT(expected, 1);
  EXPECT_NEAR(energy, expected, 1e-5);
}

TEST(SlipParts, SeparateLimitsLoseTheTargetAtTheAngle) {
  const CaptureResult r = run(
      scene("holds: {force: 4, moment: 0.5, combined: components, beyond: slips, lost_angle: 0.1}", pulse(50, 10), 6));
  expect_sound(r);
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_TRUE(r.losses[0].by_slip);
  EXPECT_NEAR(r.losses[0].time, 1 + std::sqrt(2 * 0.1 / turn(10, 0.5).push), 1e-8);
  EXPECT_EQ(r.slips.at(0).ended, SlipEnd::lost);
}

// --- Points and hinges ---

// A point transmits no moment: the box does not rotate with the servicer.
TEST(SlipParts, APointSlides) {
  const CaptureResult r =
      run(scene("model: point, holds: {force: 4, beyond: slips, kinetic_ratio: 0.75}", pulse(50, 2), 6));
  expect_sound(r);
  const Slide along = slide(50, 3);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  EXPECT_NEAR(r.slips[0].until, along.until(), 1e-5);
  EXPECT_NEAR(r.slips[0].distance, along.distance(), 1e-7);
  EXPECT_EQ(r.slips[0].angle, 0);
  EXPECT_EQ(r.grasps[0].slip_angle, 0);
  EXPECT_NEAR(box(r).angular_velocity[0], 0, 1e-12);
  EXPECT_NEAR(box(r).velocity[0], 50 / kAll, 1e-9);
}

// The force slips along the axis of the hinge, about which the box rotates freely.
TEST(SlipParts, AHingeSlidesAndKeepsItsAxis) {
  const CaptureResult r = run(
      scene("model: hinge, axis: [1, 0, 0], holds: {force: 4, beyond: slips, kinetic_ratio: 0.75}", pulse(50, 2), 6));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  EXPECT_NEAR(r.slips[0].distance, slide(50, 3).distance(), 1e-7);
  EXPECT_NEAR(r.grasps[0].slip_angle, 0, 1e-12);
  EXPECT_NEAR(box(r).angular_velocity[0], 0, 1e-12);
}

// The same with a force across the axis, so that the closure of the axis carries a moment about y.
TEST(SlipParts, AHingeThatSlidesAcrossItsAxisTurnsOnlyAboutIt) {
  const CaptureResult r = run(scene("model: hinge, axis: [1, 0, 0], holds: {force: 1, beyond: slips}",
                                    pushed("[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 40, 0, 0, 0], [2, 0, 0, 0, 0, 0, 0]"), 3));
  expect_sound(r);
  ASSERT_FALSE(r.slips.empty());
  EXPECT_GT(r.slips[0].distance, 0.01);
  EXPECT_NEAR(r.grasps[0].slip_angle, 0, 1e-12);
  EXPECT_GT(std::abs(box(r).angular_velocity[1]), 1e-3);
  EXPECT_NEAR(box(r).angular_velocity[1], r.post_impact_end->base.angular_velocity[1], 1e-11);
}

// The moment normal to the axis slips; the point of the grasp is held.
TEST(SlipParts, AHingeTurnsByItsMoment) {
  const CaptureResult r = run(
      scene("model: hinge, axis: [0, 1, 0], holds: {moment: 0.5, beyond: slips, kinetic_ratio: 0.8}", pulse(0, 10), 8));
  expect_sound(r);
  const Slide about = turn(10, 0.4);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].until, about.until(), 1e-5);
  EXPECT_NEAR(r.slips[0].angle, about.distance(), 1e-7);
  EXPECT_NEAR(r.slips[0].distance, 0, 1e-12);
  EXPECT_NEAR(r.grasps[0].slip_angle, about.distance(), 1e-7);
}

// --- Closed loops ---

// A hinge of which only the force slips, and a rigid grasp of which both parts do, on one box: their closures and
// frictions act together, within the tree and between two trees.
TEST(SlipParts, TwoGraspsOfALoopSlipInSpace) {
  std::string text = held_by_two("force: 2, beyond: slips, kinetic_ratio: 0.9",
                                 "force: 3, moment: 0.7, combined: components, beyond: slips, kinetic_ratio: 0.9");
  text.erase(text.find("external_wrenches"));
  text.replace(text.find("point: l, "), 10, "point: l, model: hinge, axis: [0, 0.6, 0.8], ");
  text +=
      pushed("[0, 0, 0, 0, 0, 0, 0], [1, 20, 30, 10, 6, 4, 13], [2, -25, -20, 20, -6, 4, -13], [3, 0, 0, 0, 0, 0, 0]");
  const CaptureResult r = run(text);
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 2u);
  EXPECT_GT(r.slips[1].time, r.slips[0].time);
  EXPECT_GT(r.slips[1].angle, 0.01);
  EXPECT_NEAR(r.slips[0].energy, 0.9 * 2 * r.slips[0].distance, 1e-5);
  EXPECT_NEAR(r.slips[1].energy, 0.9 * (3 * r.slips[1].distance + 0.7 * r.slips[1].angle), 1e-5);
  EXPECT_NEAR(r.grasps.at(0).slip_angle, 0, 1e-11);
}

// --- Impacts while a grasp slips ---

// The other arm closes, as a point, beside the first one, whose force slips.
std::string closing_beside(const std::string& first) {
  std::string text = held_by_two(first, "force: 400");
  const std::string other = "point: r, ";
  return text.replace(text.find(other), other.size(), "point: r, model: point, closes_at: 2.5, ");
}

// The impulse acts 0.2 m beside the centre of the box, whose orientation is held: the first grasp transmits its moment.
TEST(SlipParts, TheHeldOrientationTransmitsImpulses) {
  const CaptureResult r = run(closing_beside("force: 2, beyond: slips, kinetic_ratio: 0.8"));
  expect_sound(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  const ImpactReport& impact = r.impacts[1];
  ASSERT_EQ(impact.grasps.size(), 2u);
  EXPECT_EQ(impact.grasps[0].end_effector, "tip");
  EXPECT_EQ(impact.grasps[0].impulse_magnitude, 0);
  EXPECT_GT(impact.grasps[1].impulse_magnitude, 1);
  EXPECT_NEAR(impact.grasps[0].angular_impulse[2], 0.2 * impact.grasps[1].impulse_magnitude, 1e-10);
  EXPECT_NEAR(impact.targets_after.at(0).angular_velocity[2], 0, 1e-12);
  EXPECT_NEAR(impact.base_angular_velocity_change[2], 0, 1e-12);
}

// The same in a compliant impact, whose limit of stiff springs it is: the closure of the orientation joins two trees.
TEST(SlipParts, TheHeldOrientationActsInCompliantImpacts) {
  const std::string rigid = closing_beside("force: 2, beyond: slips, kinetic_ratio: 0.8");
  const CaptureResult plastic = run(rigid);
  for (const char* spring :
       {"linear_stiffness: 1e5, linear_damping: 2e3", "linear_stiffness: 1e7, linear_damping: 2e4"}) {
    std::string text = rigid;
    const std::string impact = "impact: {duration: 1e-2, joints: braked}";
    text.replace(text.find(impact), impact.size(),
                 std::string("impact: {law: compliant, joints: braked, grasp: {angular_stiffness: 1e5, "
                             "angular_damping: 300, ") +
                     spring + "}}");
    const CaptureResult r = run(text);
    expect_sound(r);
    ASSERT_EQ(r.impacts.size(), 2u);
    const ImpactReport& impact_in_time = r.impacts[1];
    ASSERT_TRUE(impact_in_time.compliant);
    EXPECT_NEAR(impact_in_time.targets_after.at(0).angular_velocity[2], 0, 1e-10);
    const double exact = plastic.impacts[1].grasps[1].impulse_magnitude;
    const double off = std::abs(impact_in_time.grasps[0].impulse_magnitude - exact) / exact;
    std::printf("[ measured ] %s: impulse off by %.3g\n", spring, off);
    EXPECT_LT(off, 5e-3);
  }
}

// Beyond its limit the held moment opens the whole grasp.
TEST(SlipParts, AHeldPartBeyondItsLimitInAnImpactOpensTheGrasp) {
  const CaptureResult r =
      run(closing_beside("force: 2, moment: 1, combined: components, beyond: slips, kinetic_ratio: 0.8"));
  expect_sound(r);
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_EQ(r.losses[0].end_effector, "tip");
  EXPECT_TRUE(r.losses[0].in_impact);
  EXPECT_FALSE(r.losses[0].by_slip);
  EXPECT_NEAR(r.losses[0].time, 2.5, 1e-12);
  EXPECT_EQ(r.slips.at(0).ended, SlipEnd::lost);
  EXPECT_FALSE(r.grasps.at(0).slips);
  EXPECT_FALSE(r.grasps.at(0).captured);
}

}  // namespace slip_parts_test
}  // namespace grapnel::testing
