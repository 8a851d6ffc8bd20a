/// Grasps that slip: closed forms of onset, motion and end of a slip, load sharing, loss after a slip, and results of
/// grasps below their limits.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "capture/loop_case.hpp"
#include "capture/slipping_box.hpp"
#include "grapnel/result/verdicts.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace grasp_slips_test {

using namespace held_box;
using ::testing::HasSubstr;

TEST(GraspSlips, AForceSlidesAndSticksByTheClosedForm) {
  const CaptureResult r = run(scene("holds: {force: 4, beyond: slips, kinetic_ratio: 0.75}", pulse(50), 6));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  const SlipReport& slip = r.slips[0];
  const Slide by = slide(50, 3);
  EXPECT_NEAR(slip.time, 1, 1e-12);
  EXPECT_NEAR(slip.force, 8, 1e-9);
  EXPECT_EQ(slip.ended, SlipEnd::sticks);
  EXPECT_NEAR(slip.until, by.until(), 1e-5);
  EXPECT_NEAR(slip.distance, by.distance(), 1e-8);
  EXPECT_NEAR(slip.energy, 3 * by.distance(), 1e-8);
  EXPECT_NEAR(slip.angle, 0, 1e-12);
  // Afterwards all bodies move with the impulse.
  EXPECT_NEAR(r.post_impact_end->base.velocity[0], 50 / kAll, 1e-10);
  EXPECT_NEAR(r.post_impact_end->targets.at(0).velocity[0], 50 / kAll, 1e-10);
  const double gap = r.post_impact_end->targets.at(0).position[0] - r.post_impact_end->base.position[0];
  EXPECT_NEAR(gap, 1 - by.distance(), 1e-8);
  ASSERT_EQ(r.grasps.size(), 1u);
  EXPECT_TRUE(r.grasps[0].captured);
  EXPECT_FALSE(r.grasps[0].slips);
  EXPECT_NEAR(r.grasps[0].slip_distance, by.distance(), 1e-8);
  EXPECT_THAT(capture_sentence(r), HasSubstr("tip slipped at t = 1 s, by 397 mm"));
  EXPECT_THAT(capture_sentence(r), HasSubstr("holds since t = 3.6667 s"));
}

TEST(GraspSlips, AMomentTurnsAndSticksByTheClosedForm) {
  const CaptureResult r = run(scene("holds: {moment: 0.5, beyond: slips, kinetic_ratio: 0.8}", pulse(0, 10), 8));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  const Slide by = turn(10, 0.4);
  EXPECT_NEAR(r.slips[0].time, 1, 1e-12);
  EXPECT_NEAR(r.slips[0].until, by.until(), 1e-5);
  EXPECT_NEAR(r.slips[0].angle, by.distance(), 1e-8);
  EXPECT_NEAR(r.slips[0].distance, 0, 1e-12);
  EXPECT_NEAR(r.slips[0].energy, 0.4 * by.distance(), 1e-8);
}

// With equal limits at rest and in motion, a ramp makes it slip with the third power of time.
TEST(GraspSlips, BeginsExactlyAtTheLimitOfARamp) {
  const CaptureResult r =
      run(scene("holds: {force: 4, beyond: slips}", pushed("[0, 0, 0, 0, 0, 0, 0], [10, 100, 0, 0, 0, 0, 0]")));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].time, 2.5, 1e-9);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::slips);
  EXPECT_EQ(r.slips[0].until, 4);
  EXPECT_NEAR(r.slips[0].distance, 10 / kServicer * std::pow(1.5, 3) / 6, 1e-8);
  EXPECT_TRUE(r.captured());
  EXPECT_TRUE(r.grasps[0].slips);
  EXPECT_THAT(capture_sentence(r), HasSubstr("and slips at the end"));
}

// Relative velocity along x and angular velocity about it, under the wrench on the ellipsoid: an independent method of
// order 4.
struct Rates {
  double v = 0, w = 0;
};
struct Ellipsoid {
  double force, moment;
  Rates derivative(const Rates& r, double f, double m) const {
    const double n = std::hypot(force * r.v, moment * r.w);
    return {f / kServicer - force * force * r.v / n / kReduced,
            m / kServicerTurn - moment * moment * r.w / n / kReducedTurn};
  }
};

// Under constant force and moment from rest the direction of the twist is constant; then it turns, until both parts
// come to rest together.
TEST(GraspSlips, ForceAndMomentSlideTogetherOnTheEllipsoid) {
  const CaptureResult r = run(scene("holds: {force: 4, moment: 0.5, beyond: slips}", pulse(50, 10), 8));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  const Ellipsoid limits{4, 0.5};
  double low = 0, high = 1e3;
  const auto at = [&](double n) {
    return Rates{50 / kServicer / (1 + 16 / (kReduced * n)), 10 / kServicerTurn / (1 + 0.25 / (kReducedTurn * n))};
  };
  for (int i = 0; i < 200; ++i) {
    const double n = 0.5 * (low + high);
    const Rates a = at(n);
    (std::hypot(4 * a.v, 0.5 * a.w) > n ? low : high) = n;
  }
  Rates rate = at(low);
  double distance = 0.5 * rate.v, angle = 0.5 * rate.w, time = 2;
  for (double h = 1e-4; std::hypot(4 * rate.v, 0.5 * rate.w) > 1e-7;) {
    h = std::min(h, 0.02 * std::hypot(4 * rate.v, 0.5 * rate.w) / (16 / kReduced + 0.25 / kReducedTurn));
    const auto moved = [&](const Rates& d, double by) { return Rates{rate.v + by * d.v, rate.w + by * d.w}; };
    const Rates k1 = limits.derivative(rate, 0, 0), k2 = limits.derivative(moved(k1, h / 2), 0, 0);
    const Rates k3 = limits.derivative(moved(k2, h / 2), 0, 0), k4 = limits.derivative(moved(k3, h), 0, 0);
    const Rates after{rate.v + h / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v),
                      rate.w + h / 6 * (k1.w + 2 * k2.w + 2 * k3.w + k4.w)};
    distance += h / 6 * (rate.v + 4 * (rate.v + h / 4 * (k1.v + k2.v)) + after.v);
    angle += h / 6 * (rate.w + 4 * (rate.w + h / 4 * (k1.w + k2.w)) + after.w);
    rate = after, time += h;
  }
  EXPECT_NEAR(r.slips[0].time, 1, 1e-12);
  EXPECT_NEAR(r.slips[0].distance, distance, 1e-5);
  EXPECT_NEAR(r.slips[0].angle, angle, 1e-5);
  EXPECT_NEAR(r.slips[0].until, time, 1e-4);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  // Work-energy of the relative motion: the loads give it what friction dissipates.
  const Rates end = at(low);
  const double given = 50 / kServicer * kReduced * 0.5 * end.v + 10 / kServicerTurn * kReducedTurn * 0.5 * end.w;
  EXPECT_NEAR(r.slips[0].energy, given, 1e-5 * given);
}

TEST(GraspSlips, AGraspBelowItsLimitsDoesNotDependOnThem) {
  const auto end = [](const std::string& grasp) { return *run(scene(grasp, pulse(50, 2), 3)).post_impact_end; };
  const PhaseEnd opens = end("holds: {force: 9, moment: 9}"),
                 slips = end("holds: {force: 9, moment: 9, beyond: slips}");
  EXPECT_EQ(opens.base.velocity[0], slips.base.velocity[0]);
  EXPECT_EQ(opens.targets.at(0).position[0], slips.targets.at(0).position[0]);
  EXPECT_EQ(opens.targets.at(0).angular_velocity[0], slips.targets.at(0).angular_velocity[0]);
  EXPECT_NE(opens.base.velocity[0], 0);
}

TEST(GraspSlips, AGraspThatSlipsTooFarLosesItsTarget) {
  const CaptureResult r =
      run(scene("holds: {force: 4, beyond: slips, kinetic_ratio: 0.75, lost_distance: 0.1}", pulse(50), 4));
  expect_sound(r);
  const double push = 50 / kServicer - 3 / kReduced, time = std::sqrt(2 * 0.1 / push);
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_NEAR(r.losses[0].time, 1 + time, 1e-9);
  EXPECT_TRUE(r.losses[0].by_slip);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::lost);
  EXPECT_NEAR(r.slips[0].distance, 0.1, 1e-9);
  EXPECT_NEAR(r.post_impact_end->targets.at(0).velocity[0], 3 / kBox * time, 1e-9);
  EXPECT_FALSE(r.captured());
  EXPECT_THAT(r.grasps[0].reason, HasSubstr("it slipped by 0.1 m"));
  EXPECT_THAT(capture_sentence(r), HasSubstr("captured: NO"));
}

TEST(GraspSlips, AReleaseEndsASlip) {
  std::string text = scene("holds: {force: 4, beyond: slips}", pulse(50), 3);
  const std::string braked = "joints: braked}\n";
  text.replace(text.rfind(braked), braked.size(), "joints: braked, release: [{after: 1.5}]}\n");
  const CaptureResult r = run(text);
  expect_sound(r);
  ASSERT_EQ(r.releases.size(), 1u);
  EXPECT_EQ(r.releases[0].end_effectors, std::vector<std::string>{"tip"});
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::released);
  EXPECT_NEAR(r.post_impact_end->targets.at(0).velocity[0], 4 / kBox * 0.5, 1e-9);
}

// A reversed load makes it slip in the other direction, without a rest between.
TEST(GraspSlips, AReversedLoadReversesTheSlip) {
  const std::string loads =
      "external_wrenches:\n"
      "  - {body: base, force: [50, 0, 0], time: {shape: constant, start: 1, end: 2}}\n"
      "  - {body: base, force: [-50, 0, 0], time: {shape: constant, start: 2, end: 4}}\n";
  const CaptureResult r = run(scene("holds: {force: 4, beyond: slips}", loads, 10));
  expect_sound(r);
  // Relative speed: up with a - f, down with a + f to rest, backwards with a - f, then to rest with f.
  const double a = 50 / kServicer, f = 4 / kReduced;
  const double peak = a - f, turn = 2 + peak / (a + f), back = (a - f) * (4 - turn), end = 4 + back / f;
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].until, end, 1e-4);
  EXPECT_NEAR(r.slips[0].distance, 0.5 * peak * (turn - 1) + 0.5 * back * (end - turn), 1e-5);
  EXPECT_NEAR(r.grasps[0].slip_distance, std::abs(0.5 * peak * (turn - 1) - 0.5 * back * (end - turn)), 1e-5);
}

// A push on a grasp that holds: all bodies move as one, so no force does work on their relative motion.
TEST(GraspSlips, APushWithoutSlipDoesNoWorkWithinTheSystem) {
  const CaptureResult r = run(scene("holds: {force: 40, beyond: slips}", pulse(50), 10));
  expect_sound(r);
  EXPECT_TRUE(r.slips.empty());
  EXPECT_NEAR(r.post_impact_end->base.velocity[0], 50 / kAll, 1e-10);
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.name == "energy_drift") {
      EXPECT_LT(e.value, 1e-12);  // measured 2e-27
    }
  }
}

TEST(GraspSlips, AGraspLostBySlipClosesAgainOnArrival) {
  std::string text =
      scene("holds: {force: 4, beyond: slips, kinetic_ratio: 0.75, lost_distance: 0.1}, closes_again_on_arrival: true",
            "external_wrenches:\n"
            "  - {body: base, force: [-60, 0, 0], time: {shape: constant, start: 1, end: 1.8}}\n"
            "  - {body: base, force: [120, 0, 0], time: {shape: constant, start: 1.8, end: 2.2}}\n",
            8);
  text.replace(text.find("duration: 1e-2"), 14, "duration: 5.0");  // mean forces of impacts below the limit
  const CaptureResult r = run(text);
  expect_sound(r);
  const double pull = 60 / kServicer - 3 / kReduced;
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_TRUE(r.losses[0].by_slip);
  EXPECT_NEAR(r.losses[0].time, 1 + std::sqrt(2 * 0.1 / pull), 1e-9);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::lost);
  EXPECT_EQ(r.impacts.size(), 2u);
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.grasps[0].closings, 2);
  EXPECT_FALSE(r.grasps[0].lost);
  EXPECT_FALSE(r.grasps[0].slips);
  EXPECT_FALSE(r.grasps[0].slipped) << "it has not slipped since it closed";
  EXPECT_THAT(capture_sentence(r), HasSubstr("tip lost at t = "));
  EXPECT_NEAR(r.post_impact_end->base.velocity[0], 0, 1e-9) << "the loads have no net impulse";
}

// The arm consists of two links that a coupling extends together. Along x it acts on the box like a servicer of the
// mass 1 / (J M^-1 J^T).
TEST(GraspSlips, ACoupledArmSlidesByTheClosedForm) {
  std::string text = scene("holds: {force: 4, beyond: slips, kinetic_ratio: 0.75}", "", 6);
  const auto put = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  put("  end_effectors: [{name: tip, link: arm, position: [0.3, 0, 0]",
      "    - {name: hand, parent: arm, mass: 5, inertia: [0.1, 0.1, 0.1], joint: {name: extend, type: prismatic, axis: "
      "[1, 0, 0], mimic: {joint: slide, ratio: 0.5}}}\n"
      "  end_effectors: [{name: tip, link: hand, position: [0.3, 0, 0]");
  put("initial: {joints: [0]}", "initial: {joints: [0, 0]}");
  put("impact: {duration: 1e-2, joints: braked}", "impact: {duration: 1e-2}");
  put("joints: braked}", "joints: free}");
  text += "external_wrenches: [{body: hand, force: [10, 0, 0], time: {shape: constant, start: 1, end: 2}}]\n";
  const CaptureResult r = run(text);
  expect_sound(r);
  // Velocities of base and slide: M = [a b; b c], J = [1 1.5].
  const double a = kBase + 2 * kArm, b = kArm + 1.5 * kArm, c = kArm + 2.25 * kArm;
  const double mobility = (c - 2 * 1.5 * b + 2.25 * a) / (a * c - b * b);
  const Slide by{(10 - 3) * mobility - 3 / kBox, 3 * (mobility + 1 / kBox)};
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].time, 1, 1e-12);
  EXPECT_NEAR(r.slips[0].force, 10 / (1 + 1 / (kBox * mobility)), 1e-9);
  EXPECT_NEAR(r.slips[0].until, by.until(), 1e-5);
  EXPECT_NEAR(r.slips[0].distance, by.distance(), 1e-7);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
}

// Tides accelerate box and servicer by about 3 n^2 x 1 m relative to each other.
TEST(GraspSlips, AForceSlidesInAnOrbit) {
  const CaptureResult r =
      run(scene("holds: {force: 4, beyond: slips, kinetic_ratio: 0.75}", pulse(50) + "orbit: {altitude: 500 km}\n", 6));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  EXPECT_NEAR(r.slips[0].distance, slide(50, 3).distance(), 1e-4);
  EXPECT_GT(std::abs(r.slips[0].distance - slide(50, 3).distance()), 1e-7) << "without tides";
}

// --- Closed loops ---

// Both arms reach their limits at the same time, and slip along parallel lines.
TEST(GraspSlips, BothGraspsOfALoopSlipTogether) {
  const CaptureResult r = run(held_by_two("force: 2, beyond: slips", "force: 2, beyond: slips"));
  expect_sound(r);
  const double ramp = 10 * kBox / kAll, onset = 4 / ramp;
  ASSERT_EQ(r.slips.size(), 2u);
  for (const SlipReport& slip : r.slips) {
    EXPECT_NEAR(slip.time, onset, 1e-9);
    EXPECT_EQ(slip.ended, SlipEnd::slips);
    EXPECT_NEAR(slip.distance, 10 / kServicer * std::pow(4 - onset, 3) / 6, 1e-8);
  }
}

// Each of two arms carries half of the force. The first one stays at its limit, and the second takes the rest, up to
// its own limit.
TEST(GraspSlips, TheOtherGraspTakesWhatASlippingGraspDoesNotHold) {
  const double ramp = 10 * kBox / kAll;
  const CaptureResult r = run(held_by_two("force: 2, beyond: slips", "force: 4"));
  expect_sound(r);
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].time, 4 / ramp, 1e-9);
  EXPECT_EQ(r.slips[0].end_effector, "tip");
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_EQ(r.losses[0].end_effector, "other");
  EXPECT_NEAR(r.losses[0].time, (2 + 4) / ramp, 1e-8);
  EXPECT_GT(r.slips[0].distance, 0.005);  // measured 0.0077
}

// Both parts slip, or only one: the other is a closure within the tree, or between two trees.
TEST(GraspSlips, OneArmOfTwoOrTheOnlyArmSlipsAndTheLedgerCloses) {
  SKIP_UNDER_SANITIZERS();
  int slipped = 0;
  for (const std::vector<int>& arms : {std::vector<int>{0, 0}, std::vector<int>{0}}) {
    CaptureProblem p = random_loops({arms, {}, 7, 0.4, 0.4}, 60);
    const CaptureResult held = simulate_capture(p);
    const auto most = [&](const std::string& quantity) {
      double largest = 0;
      for (std::size_t s = first_sample(held, "post_impact"); s < held.series.time.size(); ++s)
        largest = std::max(largest, norm(vector_at(held, "grasps/hand0/" + quantity, s)));
      return largest;
    };
    p.impact->duration = 1e9;  // mean forces of the impact are not the subject
    for (const bool force : {true, false}) {
      for (const bool moment : {true, false}) {
        if (!force && (!moment || arms.size() == 2)) continue;
        SCOPED_TRACE(fmt::format("{} arms, force {}, moment {}", arms.size(), force, moment));
        GraspLimits limits;
        if (force) limits.force = 0.8 * most("force");
        if (moment) limits.moment = 0.8 * most("moment");
        limits.beyond = GraspLimits::Beyond::slips;
        limits.kinetic_ratio = 0.9;
        p.grasps[0].holds = limits;
        const CaptureResult r = simulate_capture(p);
        expect_passes(r);
        ASSERT_FALSE(r.slips.empty());
        ++slipped;
        for (const SlipReport& slip : r.slips) {
          EXPECT_GT(slip.energy, 0);
          if (!force) {
            EXPECT_NEAR(slip.distance, 0, 1e-12);
          }
          if (!moment) {
            EXPECT_NEAR(slip.angle, 0, 1e-12);
          }
        }
      }
    }
  }
  EXPECT_EQ(slipped, 5);
}

// --- Flexible robots ---

TEST(GraspSlips, AFlexibleArmSlips) {
  SKIP_UNDER_SANITIZERS();
  std::string text = scene("holds: {force: 2, moment: 0.4, beyond: slips, kinetic_ratio: 0.9}",
                           pushed("[0, 0, 0, 0, 0, 0, 0], [0.05, 0, 60, 0, 0, 0, 0], [3, 0, 60, 0, 0, 0, 0]"), 0.3);
  const std::string shape = "      geometry: {shape: sphere, radius: 0.05, position: [0.24, 0, 0]}\n";
  text.replace(text.find(shape), shape.size(),
               "      beam: {to: [0.3, 0, 0], segments: 2, mass_per_length: 1, bending_stiffness_y: 40, "
               "bending_stiffness_z: 40}\n");
  const CaptureResult r = run(text);
  expect_sound(r);
  ASSERT_FALSE(r.slips.empty());
  EXPECT_GT(r.slips[0].energy, 0);
}

}  // namespace grasp_slips_test
}  // namespace grapnel::testing
