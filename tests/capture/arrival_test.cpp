/// Grasps with a relative motion on arrival: planned, and with given final angles.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/loop_case.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace arrival_test {

// Relative twist of the end-effector and its grasp point at the end of the approach.
void expect_arrival(const CaptureProblem& p, bool angular, Worst& worst, int where) {
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  for (std::size_t i = 0; i < p.grasps.size(); ++i) {
    const EndEffectorMotion& e = r.approach_end->end_effectors.at(i);
    EXPECT_LT(worst.note(norm(e.relative_velocity - p.grasps[i].relative_velocity), where), 1e-9);
    if (!angular) continue;
    EXPECT_LT(worst.note(norm(e.relative_angular_velocity - p.grasps[i].relative_angular_velocity), where), 1e-9);
  }
  const GraspError m = grasp_error(p, r, 0, last_sample(r, "approach"));
  EXPECT_LT(norm(m.relative_velocity() - p.grasps[0].relative_velocity), 1e-9);
}

TEST(RelativeVelocity, AtArrival) {
  Worst worst("relative velocity");
  for (int plan = 0; plan < 2; ++plan) {
    for (RateMatch match : {RateMatch::velocity, RateMatch::twist, RateMatch::velocity_least_rates}) {
      SCOPED_TRACE(plan);
      CaptureProblem p = thesis_case();
      p.approach->match = match;
      if (plan == 1) {
        p.approach->final_position.clear();
        p.approach->plan.emplace();
      }
      p.grasps[0].relative_velocity = {0.03, -0.05, 0};
      p.grasps[1].relative_velocity = {-0.02, 0.01, 0};
      const bool twist = match == RateMatch::twist;
      if (twist) p.grasps[0].relative_angular_velocity = {0, 0, 0.04};
      if (plan == 0) {
        // The given angles miss the grasp points slightly; the rates match the motion at the actual positions.
        const CaptureResult r = simulate_capture(p);
        ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
        expect_passes(r);
        for (std::size_t i = 0; i < 2; ++i) {
          const EndEffectorMotion& e = r.approach_end->end_effectors.at(i);
          EXPECT_LT(worst.note(norm(e.relative_velocity - p.grasps[i].relative_velocity), plan), 1e-9);
        }
        continue;
      }
      expect_arrival(p, twist, worst, plan);
    }
  }
}

TEST(RelativeVelocity, InThreeDimensions) {
  SKIP_UNDER_SANITIZERS();
  Worst worst("relative velocity");
  for (int i = 0; i < 3; ++i) {
    CaptureProblem p = scenario("dual-arm-tumbling-targets.yaml");
    p.approach->straight_in.reset();
    p.approach->tracking = {};
    p.approach->match = i == 1 ? RateMatch::velocity : RateMatch::twist;
    p.post_impact.reset();
    p.output_interval = 5;
    Random random(700 + i);
    for (GraspSetup& g : p.grasps) {
      g.relative_velocity = random.vector(0.01);
      if (i != 1) g.relative_angular_velocity = random.vector(0.01);
    }
    SCOPED_TRACE(i);
    expect_arrival(p, i != 1, worst, i);
  }
}

// The impulse is proportional to the arrival speed.
TEST(RelativeVelocity, DeterminesImpulse) {
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.approach->match = RateMatch::twist;
  std::vector<double> impulses;
  for (double speed : {0.0, 0.02, 0.04}) {
    p.grasps[0].relative_velocity = {0, -speed, 0};
    const CaptureResult r = simulate_impact_only(p);
    impulses.push_back(norm(r.impact()->grasps[0].impulse));
  }
  EXPECT_LT(impulses[0], 1e-7);
  EXPECT_NEAR(impulses[2], 2 * impulses[1], 0.1 * impulses[1]);  // the configuration changes a little
}

}  // namespace arrival_test
}  // namespace grapnel::testing
