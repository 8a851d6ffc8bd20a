// Captures by contacts between shapes, grippers and grasps with limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/capture_case.hpp"
#include "examples/example_checks.hpp"
#include "examples/shipped_scenarios.hpp"

namespace grapnel::testing::examples_test {
namespace {

const ContactPairReport& pair_of(const CaptureResult& r, const std::string& body_a) {
  const auto found = std::ranges::find(r.contacts, body_a, &ContactPairReport::body_a);
  if (found == r.contacts.end()) throw std::runtime_error("no pair of " + body_a);
  return *found;
}

// Linear momentum of a target at a sample of the time series: m (v + w x R c).
Vector3d momentum_of(const CaptureResult& r, const TargetSetup& target, std::size_t sample) {
  const std::string path = "targets/" + target.name;
  const Vector3d arm = pose_at(r, path, sample).R * target.com;
  return target.mass *
         (vector_at(r, path + "/velocity", sample) + cross(vector_at(r, path + "/angular_velocity", sample), arm));
}

// A latched target moves with the base as one body.
void expect_latched(const CaptureResult& r, double time) {
  ASSERT_EQ(r.stages.size(), 1U);
  const StagesReport& stages = r.stages[0];
  EXPECT_EQ(stages.reached, StagesReport::Stage::latched);
  EXPECT_EQ(stages.failure, StagesReport::Failure::none);
  ASSERT_TRUE(stages.settled_time && stages.latched_time && r.post_impact_end);
  EXPECT_EQ(*stages.settled_time, *stages.latched_time);
  EXPECT_NEAR(*stages.latched_time, time, 0.1);
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
  EXPECT_LT(norm(r.impact()->grasps.at(0).relative_velocity_before), 5e-4);
  const BodyMotion &base = r.post_impact_end->base, &target = r.post_impact_end->targets[0];
  EXPECT_LT(norm(target.angular_velocity - base.angular_velocity), 1e-9);
  for (const ContactPairReport& pair : r.contacts) EXPECT_FALSE(pair.beyond_model) << pair.body_a;
}

// The grooves of the three coupled jaws centre the ring and hold it where its tube touches both plates.
void expect_a_clamped_ring(const CaptureResult& r) {
  expect_latched(r, 6.0);
  EXPECT_LT(r.impact()->grasps.at(0).gap, 1e-3);  // centred; measured 0.09 mm of 14 mm at the beginning
  for (const ContactPairReport& jaw : r.contacts) EXPECT_TRUE(jaw.touches_at_end);
  EXPECT_EQ(r.contacts.size(), 3U);
  const double q = value_at(r, "joints/position", r.series.time.size() - 1);
  // The plates, 5 mm from the apex of the groove to their faces, hold a capsule of 12 mm at (12 + 5) mm / sin 30 deg
  // from the apex; the ring's radius is between 0.3 m cos 15 deg and 0.3 m.
  const double apex = 0.4 - q, clearance = (0.012 + 0.005) / 0.5;
  EXPECT_GT(apex, 0.3 * std::cos(std::acos(-1.0) / 12) + clearance - 2e-3);
  EXPECT_LT(apex, 0.3 + clearance + 2e-3);
}

// The probe is guided into the throat, and the hooks hold the nozzle from behind.
void expect_a_probe_in_the_throat(const CaptureResult& r) {
  expect_latched(r, 18.8);
  EXPECT_LT(r.impact()->grasps.at(0).gap, 0.02);  // 50 mm off the axis at the beginning
  EXPECT_GE(pair_of(r, "probe").touches, 1);
  for (const char* hook : {"hook-1", "hook-2", "hook-3"}) EXPECT_TRUE(pair_of(r, hook).touches_at_end) << hook;
}

// The CubeSat's momentum is the impulse of the palm, except for what the fingers give by friction. A gentler approach
// succeeds.
void expect_a_miss(const CaptureProblem& p, const CaptureResult& r) {
  ASSERT_EQ(r.stages.size(), 1U);
  EXPECT_EQ(r.stages[0].reached, StagesReport::Stage::contact);
  EXPECT_EQ(r.stages[0].failure, StagesReport::Failure::pushed_away);
  const ContactPairReport& palm = pair_of(r, "palm");
  const double fingers = pair_of(r, "left").impulse + pair_of(r, "right").impulse;
  const Vector3d h = momentum_of(r, p.targets[0], r.series.time.size() - 1);
  EXPECT_NEAR(h[2], palm.impulse, 0.5 * fingers + 0.01);
  EXPECT_GT(palm.impulse, 1);
  EXPECT_LT(fingers, 0.05);
  const CaptureResult gentle =
      simulate_capture(load("missed-capture", {{"initial.base.velocity", "[0, 0, 0.05]"}, {"motion.duration", "6.5"}}));
  EXPECT_EQ(gentle.stages.at(0).reached, StagesReport::Stage::settled);
  EXPECT_EQ(gentle.stages.at(0).failure, StagesReport::Failure::none);
  EXPECT_NEAR(gentle.stages.at(0).settled_time.value_or(0), 5.37, 0.05);
}

// The free tank gains the impulse of its only contact.
void expect_targets_to_meet(const CaptureProblem& p, const CaptureResult& r) {
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
  ASSERT_EQ(r.contacts.size(), 1U);
  const ContactPairReport& pair = r.contacts[0];
  EXPECT_GE(pair.touches, 1);
  EXPECT_FALSE(pair.touches_at_end);
  const std::size_t last = r.series.time.size() - 1;
  const Vector3d gain = momentum_of(r, p.targets[1], last) - momentum_of(r, p.targets[1], 0);
  // Between the normal impulse and that with friction at its limit.
  EXPECT_GE(norm(gain), pair.impulse * (1 - 1e-3));
  EXPECT_LE(norm(gain), pair.impulse * std::hypot(1, 0.3) * (1 + 1e-6));
  EXPECT_GT(pair.impulse, 1);
}

// Fingers that touch a box and each other keep it between them, without any grasp.
void expect_a_cage(const CaptureProblem& p, const CaptureResult& r) {
  EXPECT_EQ(r.contacts.size(), 37U);
  int touched = 0;
  double peak = 0, lost = 0;
  for (const ContactPairReport& pair : r.contacts) {
    touched += pair.touches > 0;
    peak = std::max(peak, pair.peak_force);
    lost += pair.damping_loss + pair.friction_loss;
    EXPECT_FALSE(pair.beyond_model) << pair.body_a << " " << pair.body_b;
  }
  EXPECT_GE(touched, 9);         // measured 11
  EXPECT_NEAR(peak, 17.4, 0.5);  // measured 17.37
  EXPECT_GT(lost, 0.1);
  ASSERT_TRUE(r.post_impact_end);
  const BodyMotion &base = r.post_impact_end->base, &stage = r.post_impact_end->targets[0];
  const Vector3d offset = transposed_times(rotation_matrix(base.quaternion_wxyz), stage.position - base.position);
  EXPECT_LT(std::hypot(offset[0], offset[1]), 0.2);  // the fingers are at 0.55 m
  CaptureProblem without = p;
  without.contacts.clear();
  const CaptureResult passing = simulate_capture(without);
  EXPECT_EQ(passing.ledger.feasibility(), Verdict::no);  // fingers pass through the box
}

// One motor of 20 N presses both pads with half of it; the CubeSat comes to rest in the gripper.
void expect_a_grip(const CaptureResult& r) {
  ASSERT_EQ(r.contacts.size(), 2U);
  for (const ContactPairReport& pair : r.contacts) {
    EXPECT_TRUE(pair.touches_at_end);
    EXPECT_FALSE(pair.beyond_model);
  }
  ASSERT_FALSE(r.loops.empty());
  EXPECT_EQ(r.loops[0].closures, std::vector<std::string>{"right"});
  ASSERT_TRUE(r.post_impact_end);
  const BodyMotion &bus = r.post_impact_end->base, &cubesat = r.post_impact_end->targets[0];
  EXPECT_LT(norm(cubesat.angular_velocity - bus.angular_velocity), 1e-3);  // 18 mrad/s before
  EXPECT_NEAR(r.contacts[1].peak_force, 10, 0.1);
}

// Friction brings a CubeSat to rest between two fingers; the latch takes up what is left.
void expect_a_latched_cubesat(const CaptureResult& r) {
  ASSERT_EQ(r.stages.size(), 1U);
  const StagesReport& stages = r.stages[0];
  EXPECT_EQ(stages.reached, StagesReport::Stage::latched);
  EXPECT_EQ(stages.failure, StagesReport::Failure::none);
  EXPECT_NEAR(stages.settled_time.value_or(0), 5.62, 0.01);
  EXPECT_NEAR(stages.grip_force, 6.07, 0.02);
  EXPECT_LT(norm(r.impact()->grasps.at(0).relative_velocity_before), 5e-4);
}

// Impacts in an instant between two paddles take part of a tank's spin.
void expect_bounces(const CaptureProblem& p, const CaptureResult& r) {
  int impacts = 0;
  double lost = 0;
  for (const ContactPairReport& pair : r.contacts) {
    ASSERT_TRUE(pair.hard);
    impacts += pair.hard->impacts;
    lost += pair.hard->restitution_loss + pair.hard->friction_loss;
    EXPECT_FALSE(pair.beyond_model);
  }
  EXPECT_EQ(impacts, 6);
  EXPECT_NEAR(lost, 1.27, 0.01);
  ASSERT_TRUE(r.post_impact_end);
  EXPECT_LT(norm(r.post_impact_end->targets[0].angular_velocity), 0.25 * norm(p.targets[0].V_WT.angular));
}

// Two fingertips pull the tank against the palm with the full tension of their tendons; it comes to rest in the
// gripper. The work of the tendons is that of all motors.
void expect_a_tendon_grip(const CaptureResult& r) {
  int touching = 0;
  for (const ContactPairReport& pair : r.contacts) touching += pair.touches_at_end;
  EXPECT_EQ(touching, 3);  // the fingertips and the palm
  ASSERT_EQ(r.tendons.size(), 2U);
  for (const TendonReport& tendon : r.tendons) {
    EXPECT_EQ(tendon.largest_tension, 15);
    EXPECT_GT(tendon.work, 0.01);
  }
  ASSERT_TRUE(r.post_impact_end);
  const BodyMotion &bus = r.post_impact_end->base, &tank = r.post_impact_end->targets[0];
  EXPECT_LT(norm(tank.angular_velocity - bus.angular_velocity), 1e-6);  // 53 mrad/s before
}

// Both grippers touch the square several times and stop its spin, with the published force of 1.13 N approximately.
void expect_a_stopped_spin(const CaptureResult& r) {
  ASSERT_EQ(r.contacts.size(), 2u);
  for (const ContactPairReport& hand : r.contacts) {
    std::printf("[ measured ] %s: %d touches, %.4g N\n", hand.body_a.c_str(), hand.touches, hand.peak_force);
    EXPECT_GE(hand.touches, 2);
    EXPECT_NEAR(hand.peak_force, 0.871, 0.005);  // measured 0.8709 and 0.8716
    EXPECT_FALSE(hand.beyond_model);
  }
  EXPECT_LT(std::abs(r.post_impact_end->targets[0].angular_velocity[2]), 0.05);  // measured 0.0137
}

// Four grippers in two planes touch the tumbling cube several times and stop most of its tumbling.
void expect_a_stopped_tumble(const CaptureProblem& p, const CaptureResult& r) {
  ASSERT_EQ(r.contacts.size(), 4u);
  double friction_loss = 0;
  for (const ContactPairReport& hand : r.contacts) {
    EXPECT_GE(hand.touches, 3) << hand.body_a;  // measured 6, 6, 7 and 6
    EXPECT_FALSE(hand.beyond_model);
    friction_loss += hand.friction_loss;
  }
  EXPECT_GT(friction_loss, 0.01);
  const double before = norm(p.targets[0].V_WT.angular);
  for (int axis = 0; axis < 3; ++axis) EXPECT_GT(std::abs(p.targets[0].V_WT.angular[axis]), 0.3 * before);
  EXPECT_LT(norm(r.post_impact_end->targets[0].angular_velocity), 0.1 * before);  // measured 0.042
}

// The gripper loses the satellite at its limits and closes again at the boundary of its envelope.
void expect_a_lost_grasp(const CaptureResult& r) {
  ASSERT_EQ(r.losses.size(), 1u);
  EXPECT_NEAR(r.losses[0].time, 2.58, 0.01);
  EXPECT_NEAR(std::hypot(r.losses[0].force / 120, r.losses[0].moment / 400), 1, 1e-9);
  ASSERT_EQ(r.impacts.size(), 2u);
  EXPECT_NEAR(r.impacts[1].time, 9.13, 0.01);
  EXPECT_NEAR(r.grasps[0].distance, 0.1, 1e-9);
  EXPECT_EQ(r.grasps[0].closings, 2);
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
  // Braked gently, the grasp holds.
  const CaptureResult gentle = simulate_capture(load(
      "lost-grasp", {{"external_wrenches[0].force", "[0, 0, -300]"}, {"external_wrenches[1].force", "[0, 0, 0]"}}));
  EXPECT_TRUE(gentle.losses.empty());
  EXPECT_NEAR(gentle.grasps[0].largest_load.value(), 0.81, 0.01);  // measured 0.807
}

// Beyond its limits the gripper slips, and holds the satellite again.
void expect_a_slip(const CaptureResult& r) {
  ASSERT_EQ(r.slips.size(), 1u);
  EXPECT_NEAR(r.slips[0].time, 2.58, 0.01);
  EXPECT_NEAR(r.slips[0].until, 5.99, 0.01);
  EXPECT_EQ(r.slips[0].ended, SlipEnd::sticks);
  EXPECT_NEAR(r.slips[0].distance, 0.207, 0.001);
  EXPECT_NEAR(r.slips[0].energy, 19.94, 0.05);
  EXPECT_TRUE(r.losses.empty());
  EXPECT_TRUE(r.captured());
  EXPECT_EQ(r.ledger.feasibility(), Verdict::yes);
}

}  // namespace

ExampleChecks gripper_checks() {
  return {
      {"ring-clamp", of_result(expect_a_clamped_ring)},
      {"probe-and-nozzle", of_result(expect_a_probe_in_the_throat)},
      {"missed-capture", expect_a_miss},
      {"two-targets-meet", expect_targets_to_meet},
      {"four-arm-cage", expect_a_cage},
      {"parallel-gripper", of_result(expect_a_grip)},
      {"lost-grasp", of_result(expect_a_lost_grasp)},
      {"slipping-grasp", of_result(expect_a_slip)},
      {"cubesat-two-finger", of_result(expect_a_latched_cubesat)},
      {"hard-paddles", expect_bounces},
      {"tendon-gripper", of_result(expect_a_tendon_grip)},
      {"planar-caging", of_result(expect_a_stopped_spin)},
      {"spatial-caging", expect_a_stopped_tumble},
  };
}

}  // namespace grapnel::testing::examples_test
