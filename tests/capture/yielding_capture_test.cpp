/// Captures in which drives hold rates that contradict the grasps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/loop_case.hpp"

namespace grapnel::testing {
namespace yielding_capture_test {

using During = ImpactSetup::Joints;
using Law = ImpactSetup::Law;
using ::testing::HasSubstr;

CaptureProblem driven_loops(const std::vector<int>& targets, int joints, int index) {
  CaptureProblem p = random_loops({targets, {}, joints, 0.3, 2}, index);
  p.impact->joints = During::driven;
  return p;
}

int was_overpowered(const ImpactReport& impact) {
  int count = 0;
  for (const HeldJoint& held : impact.held_joints) count += held.was_overpowered;
  return count;
}

// Each drive's reported rate change equals the joint's velocity change; the reported work equals the energy change.
void expect_consistent_report(const CaptureResult& r, const ImpactReport& impact) {
  double work = 0;
  ASSERT_FALSE(impact.held_joints.empty());
  for (const HeldJoint& held : impact.held_joints) {
    const auto at = std::find(impact.joint_names.begin(), impact.joint_names.end(), held.joint);
    ASSERT_NE(at, impact.joint_names.end());
    const double jump = impact.joint_velocity_change[static_cast<std::size_t>(at - impact.joint_names.begin())];
    EXPECT_NEAR(held.rate_after - held.commanded_rate, jump, 1e-13);  // commanded: the rate before
    EXPECT_EQ(held.was_overpowered, std::abs(jump) > 1e-9) << held.joint;
    work += held.work;
  }
  for (const GraspImpulse& g : impact.grasps)
    work +=
        0.5 * (dot(g.impulse, g.relative_velocity_before) + dot(g.angular_impulse, g.relative_angular_velocity_before));
  EXPECT_NEAR(impact.kinetic_energy_after - impact.kinetic_energy_before, work, 1e-11 * r.ledger.scale.energy);
}

// Two or three arms, redundant or unable to follow the target; joints free, controlled or braked afterwards.
TEST(YieldingDrives, LoopsCloseWithMomentumConserved) {
  int most = 0;
  for (const std::vector<int>& targets :
       {std::vector<int>{0, 0}, std::vector<int>{0, 0, 0}, std::vector<int>{0, 0, 1}}) {
    for (const int joints : {3, 6, 7}) {
      for (const auto after :
           {PostImpactSetup::Joints::free, PostImpactSetup::Joints::pd, PostImpactSetup::Joints::braked}) {
        const int index = 200 + static_cast<int>(10 * targets.size()) + joints;
        SCOPED_TRACE(seed_note(index));
        CaptureProblem p = driven_loops(targets, joints, index);
        p.post_impact->joints = after;
        const CaptureResult r = simulate_capture(p);
        expect_passes(r);
        expect_finite(r);
        EXPECT_LT(row(r, "impact_constraint_residual").value, 1e-11);
        expect_consistent_report(r, *r.impact());
        EXPECT_GT(was_overpowered(*r.impact()), 0);
        most = std::max(most, was_overpowered(*r.impact()));
        // The third arm has a separate target: its drives hold the prescribed rates.
        for (const HeldJoint& held : r.impact()->held_joints) {
          if (targets.back() == 1 && held.joint.starts_with("arm2")) {
            EXPECT_EQ(held.rate_after, held.commanded_rate);
          }
        }
        EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
        ASSERT_FALSE(r.warnings.empty());
        EXPECT_THAT(r.warnings[0], HasSubstr("the grasps contradict the rates held by drives"));
        EXPECT_THAT(r.warnings[0], HasSubstr("rad/s (commanded "));
      }
    }
  }
  EXPECT_GE(most, 14);
}

// Grasps close one after the other: each later grasp closes a loop that contradicts the drives.
TEST(YieldingDrives, OverpoweredAtEachGrasp) {
  CaptureProblem p = driven_loops({0, 0, 0}, 6, 240);
  for (std::size_t g = 1; g < 3; ++g)
    p.grasps[g].closes = GraspSetup::Closes::at_time, p.grasps[g].closes_at = 0.5 * static_cast<double>(g);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.impacts.size(), 3u);
  EXPECT_EQ(was_overpowered(*r.impact()), 0);  // one arm alone forms no loop
  for (const HeldJoint& held : r.impact()->held_joints) EXPECT_EQ(held.rate_after, held.commanded_rate);
  for (const ImpactReport& later : r.later_impacts()) {
    EXPECT_GT(was_overpowered(later), 0);
    expect_consistent_report(r, later);
  }
}

// The same while the other arms track their approach exactly: these maintain their trajectories.
TEST(YieldingDrives, OtherDrivesMaintainTrajectories) {
  CaptureProblem p = driven_loops({0, 0, 0}, 6, 250);
  p.approach.emplace();
  p.approach->duration = 1.5;
  p.approach->profile = JointProfile::quintic;
  for (double q : p.joint_position) p.approach->final_position.push_back(q + 0.2);
  for (TargetSetup& t : p.targets) t.given_at = TargetSetup::Instant::start;
  for (std::size_t g = 0; g < 2; ++g)
    p.grasps[g].closes = GraspSetup::Closes::at_time, p.grasps[g].closes_at = 0.5 * (1 + static_cast<double>(g));
  for (const During during : {During::driven, During::braked}) {
    p.impact->joints = during;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    ASSERT_EQ(r.impacts.size(), 3u);
    EXPECT_EQ(was_overpowered(*r.impact()), 0);
    EXPECT_EQ(was_overpowered(r.impacts[1]) > 0, during == During::driven);
    for (const HeldJoint& held : r.impacts[1].held_joints) {
      if (held.joint.starts_with("arm2")) {
        EXPECT_EQ(held.rate_after, held.commanded_rate);
      }
    }
  }
}

TEST(YieldingDrives, OverpoweredUnderOtherLaws) {
  for (const Law law : {Law::bilateral_restitution, Law::restitution, Law::friction, Law::compliant}) {
    SCOPED_TRACE(static_cast<int>(law));
    CaptureProblem p = driven_loops({0, 0, 0}, 6, 260);
    p.impact->law = law;
    p.impact->restitution = p.impact->angular_restitution = 0.4;
    p.impact->friction = law == Law::friction ? 0.3 : 0;
    if (law == Law::compliant) {
      p.impact->grasp = {1e5, 2e3, 5e3, 200};
      p.impact->compliant.longest = 0.2;
    } else if (law != Law::bilateral_restitution) {
      // Two end-effectors grasp; the third touches later, during the hold, without a grasp.
      p.grasps[2].contact = true;
      p.grasps[2].closes = GraspSetup::Closes::at_time, p.grasps[2].closes_at = 0.1;
      p.targets[0].grasp_points[2].normal = Vector3d{0, 0, 1};
    }
    const CaptureResult r = simulate_capture(p);
    if (r.status != CaptureStatus::completed) {
      // If grasps and held rates press a contact together and no body can move, the impact is rejected.
      EXPECT_THAT(r.failure, HasSubstr("held rates and grasps press it together"));
      EXPECT_TRUE(law == Law::restitution || law == Law::friction);
    }
    EXPECT_LT(row(r, "linear_momentum_drift").value, 1e-11);
    EXPECT_LT(row(r, "angular_momentum_drift").value, 1e-11);
    EXPECT_GT(was_overpowered(*r.impact()), 0);
    if (law == Law::compliant) {
      // With springs the drives pull until the time limit; then grasps become rigid and overpower the drives.
      EXPECT_EQ(r.impact()->compliant->end, "time_over");
      EXPECT_FALSE(row(r, "compliant_energy_residual").pass());
    } else if (r.status == CaptureStatus::completed) {
      expect_passes(r);
    }
  }
}

}  // namespace yielding_capture_test
}  // namespace grapnel::testing
