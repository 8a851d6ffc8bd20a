#include "examples/gripper_examples.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/capture_case.hpp"
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
  expect_latched(r, 19.1);
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

}  // namespace

bool expect_gripper_example(const std::string& name, const CaptureProblem& problem, const CaptureResult& result) {
  if (name == "ring-clamp")
    expect_a_clamped_ring(result);
  else if (name == "probe-and-nozzle")
    expect_a_probe_in_the_throat(result);
  else if (name == "missed-capture")
    expect_a_miss(problem, result);
  else if (name == "two-targets-meet")
    expect_targets_to_meet(problem, result);
  else
    return false;
  return true;
}

}  // namespace grapnel::testing::examples_test
