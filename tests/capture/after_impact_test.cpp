/// Motion after the impact: joints free, PD-controlled or braked; bases held before the impact or fixed.

#include <gtest/gtest.h>

#include <algorithm>

#include "capture/capture_case.hpp"

namespace grapnel::testing {
namespace after_impact_test {

CaptureProblem with_motion(PostImpactSetup::Joints joints, double duration) {
  CaptureProblem p = thesis_case_pd();
  p.approach->duration = 10;
  p.targets[0].V_WT = {{0.1, -0.05, 0.2}, {0.01, 0, 0.02}};  // also out of the plane
  p.targets[1].V_WT.angular = {0.02, 0.1, -0.2};
  p.momentum = Momentumd{{1, 2, 3}, {3, -2, 1}};
  p.post_impact.emplace();
  p.post_impact->duration = duration;
  p.post_impact->joints = joints;
  p.post_impact->kp.assign(6, 30);
  p.post_impact->kd.assign(6, 20);
  p.output_interval = 0.5;
  return p;
}

TEST(FreeJoints, ConserveEnergyAndMomentum) {
  const CaptureResult r = simulate_capture(with_motion(PostImpactSetup::Joints::free, 30));
  expect_passes(r);
  const std::size_t s = first_sample(r, "post_impact"), end = r.series.time.size() - 1;
  EXPECT_EQ(r.series.time[end], 40);
  const double T = value_at(r, "system/kinetic_energy", s);
  ASSERT_GT(T, 0.01);
  for (std::size_t i = s; i <= end; ++i) {
    EXPECT_NEAR(value_at(r, "system/kinetic_energy", i), T, 1e-10 * T);
    for (int j = 0; j < 6; ++j) EXPECT_EQ(value_at(r, "joints/effort", i, j), 0);
  }
  EXPECT_GT(std::abs(value_at(r, "joints/position", end, 0) - value_at(r, "joints/position", s, 0)), 0.1);
}

TEST(PdJoints, ComeToRestAtInitialAnglesAndLedgerPasses) {
  CaptureProblem p = with_motion(PostImpactSetup::Joints::pd, 200);
  p.output_interval = 5;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_TRUE(row(r, "work_energy_residual").applies);
  EXPECT_FALSE(row(r, "energy_drift").applies);
  const std::size_t s = first_sample(r, "post_impact"), end = r.series.time.size() - 1;
  for (int j = 0; j < 6; ++j) {
    EXPECT_LT(std::abs(value_at(r, "joints/velocity", end, j)),
              0.05 * std::abs(value_at(r, "joints/velocity", s, j)) + 1e-3);
    EXPECT_NEAR(value_at(r, "joints/position", end, j), value_at(r, "joints/position", s, j), 0.1);
  }
  EXPECT_LT(value_at(r, "system/motor_work", end),
            value_at(r, "system/motor_work", s));  // the motors dissipate the joints' motion
}

TEST(BrakedJoints, FormRigidBody) {
  const CaptureResult r = simulate_capture(with_motion(PostImpactSetup::Joints::braked, 30));
  expect_passes(r);
  ASSERT_TRUE(r.impact()->brake);
  const BrakeReport& brake = *r.impact()->brake;
  EXPECT_EQ(brake.joints.size(), 6u);
  EXPECT_EQ(brake.impulse.size(), 6u);
  EXPECT_TRUE(row(r, "brake_energy_identity_residual").applies);
  EXPECT_LT(brake.kinetic_energy_after, brake.kinetic_energy_before);
  EXPECT_NEAR(brake.kinetic_energy_before, r.impact()->kinetic_energy_after, 1e-12 * r.ledger.scale.energy);
  // Work of the locking impulses, from the report: impulse times the mean of the rates before and after (zero).
  double work = 0;
  const std::size_t contact = first_sample(r, "contact");
  for (int j = 0; j < 6; ++j) {
    const double rate = value_at(r, "joints/velocity", contact, j) + r.impact()->joint_velocity_change[j];
    work += 0.5 * brake.impulse[j] * rate;
  }
  EXPECT_NEAR(brake.kinetic_energy_after - brake.kinetic_energy_before, work, 1e-12 * r.ledger.scale.energy);

  const std::size_t s = first_sample(r, "post_impact"), end = r.series.time.size() - 1;
  const Vector3d l = vector_at(r, "system/angular_momentum", s);
  const double T = value_at(r, "system/kinetic_energy", s);
  ASSERT_GT(norm(l), 1);
  EXPECT_NEAR(T, brake.kinetic_energy_after, 1e-14 * r.ledger.scale.energy);
  const Posed found = inverse(pose_at(r, "base", s)) * pose_at(r, "targets/target-2", s);
  for (std::size_t i = s; i <= end; ++i) {
    EXPECT_LT(norm(vector_at(r, "system/angular_momentum", i) - l), 1e-11 * r.ledger.scale.angular_momentum);
    EXPECT_NEAR(value_at(r, "system/kinetic_energy", i), T, 1e-10 * T);
    for (int j = 0; j < 6; ++j) {
      EXPECT_EQ(value_at(r, "joints/velocity", i, j), 0);
      EXPECT_EQ(value_at(r, "joints/position", i, j), value_at(r, "joints/position", s, j));
    }
    const Posed now = inverse(pose_at(r, "base", i)) * pose_at(r, "targets/target-2", i);
    EXPECT_LT(norm(now.p - found.p) + rotation_angle(transpose(found.R) * now.R), 1e-12);  // one body
  }
  const Vector3d w0 = vector_at(r, "base/angular_velocity", s), w1 = vector_at(r, "base/angular_velocity", end);
  EXPECT_GT(norm(w1 - w0), 3e-4);  // the body tumbles; measured 6.8e-4
}

TEST(HeldBase, HeldUntilImpactThenFree) {
  CaptureProblem p = with_motion(PostImpactSetup::Joints::free, 10);
  p.momentum.reset();
  p.robot.base_mode = RobotSetup::Base::held;
  p.X_WB = {rotation_about({0, 0, 1}, 0.1), {0.1, 0.2, 0.3}};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t contact = first_sample(r, "contact");
  Vector3d most = Vector3d::zero();
  for (std::size_t i = 0; i <= contact; ++i) {
    const Posed X = pose_at(r, "base", i);
    EXPECT_LT(norm(X.p - p.X_WB.p) + rotation_angle(transpose(p.X_WB.R) * X.R), 1e-14);
    if (norm(vector_at(r, "robot/linear_momentum", i)) > norm(most)) most = vector_at(r, "robot/linear_momentum", i);
  }
  EXPECT_GT(norm(most), 0.5);  // momentum from the holding wrench, included in the ledger
  EXPECT_GT(norm(r.impact()->base_velocity_change), 1e-4);
  EXPECT_GT(norm(r.post_impact_end->base.position - p.X_WB.p), 1e-3);
}

TEST(FixedBase, LedgerPassesUnderGravity) {
  for (PostImpactSetup::Joints joints :
       {PostImpactSetup::Joints::free, PostImpactSetup::Joints::pd, PostImpactSetup::Joints::braked}) {
    CaptureProblem p = with_motion(joints, 3);
    p.momentum.reset();
    p.robot.base_mode = RobotSetup::Base::fixed;
    p.X_WB = {rotation_about({0.6, 0.8, 0}, 0.2), {0.1, 0.2, 0.3}};
    p.gravity = {0.1, -0.4, -0.3};
    p.approach->duration = 4;
    p.approach->match.reset();
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    for (std::size_t i = 0; i < r.series.time.size(); ++i) {
      EXPECT_LT(norm(vector_at(r, "base/position", i) - p.X_WB.p), 1e-15);
    }
    // The targets fall to their given positions at capture.
    EXPECT_LT(norm(r.approach_end->targets[0].position - p.targets[0].X_WT.p), 1e-11);
    EXPECT_GT(norm(r.approach_start->targets[0].position - p.targets[0].X_WT.p), 1);
    EXPECT_GT(norm(r.impact()->base_impulse), 0.1);
    EXPECT_EQ(norm(r.impact()->base_velocity_change), 0);
    EXPECT_EQ(r.impact()->as_published_absent, "the base is fixed");
    // The ground applies an impulse at the contact: the momentum changes.
    const std::size_t s = first_sample(r, "contact");
    EXPECT_GT(norm(vector_at(r, "system/linear_momentum", s + 1) - vector_at(r, "system/linear_momentum", s)), 0.1);
  }
}

TEST(FreeBase, UnderGravityFallsAndBalances) {
  CaptureProblem p = with_motion(PostImpactSetup::Joints::free, 3);
  p.gravity = {0.1, -0.4, -0.3};
  p.approach->duration = 4;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t end = r.series.time.size() - 1;
  const Vector3d gained = vector_at(r, "system/linear_momentum", end) - vector_at(r, "system/linear_momentum", 0);
  EXPECT_LT(norm(gained - (580.0 * 7.0) * p.gravity), 1e-8);  // 560 kg robot and 20 kg targets for 7 s
}

TEST(Reactions, MatchBaseMomentumChange) {
  const CaptureProblem p = with_motion(PostImpactSetup::Joints::free, 1);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const ImpactReport& impact = *r.impact();
  EXPECT_LT(norm(impact.base_impulse - 500.0 * impact.base_velocity_change), 1e-12);
  EXPECT_LT(norm(impact.base_angular_impulse - 83.61 * impact.base_angular_velocity_change), 1e-12);
  ASSERT_GT(norm(impact.base_impulse), 0.01);
  ASSERT_EQ(impact.joints.size(), 6u);
  for (const JointImpulse& j : impact.joints) {
    EXPECT_LT(std::abs(j.along_axis), 1e-13);  // free joints transmit nothing along their axes
    EXPECT_GT(norm(j.impulse), 1e-3);
  }
}

// The target's momentum change between the two contact samples equals the impulses through its grasp: at the impact and
// from the brake.
TEST(Braked, GraspLoadsMatchTargetMotion) {
  CaptureProblem p = thesis_case();
  p.contact.gap = ContactSetup::Gap::weld_as_found;
  p.post_impact.emplace();
  p.post_impact->duration = 1;
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_TRUE(r.impact() && r.impact()->brake);
  ASSERT_EQ(r.impact()->brake->grasps.size(), 2u);
  const std::size_t s = first_sample(r, "contact");
  for (int i = 0; i < 2; ++i) {
    const std::string path = "targets/target-" + std::to_string(i + 1) + "/linear_momentum";
    const Vector3d gained = vector_at(r, path, s + 1) - vector_at(r, path, s);
    const Vector3d passed = r.impact()->grasps[i].impulse + r.impact()->brake->grasps[i].impulse;
    EXPECT_GT(norm(r.impact()->brake->grasps[i].impulse), 1e-2);
    EXPECT_LT(norm(gained + passed), 1e-12);  // opposite signs: impulses act on the robot; measured 1e-15
  }
  const Vector3d change = vector_at(r, "base/angular_velocity", s + 1) - vector_at(r, "base/angular_velocity", s);
  EXPECT_LT(norm(change - r.impact()->base_angular_velocity_change - r.impact()->brake->base_angular_velocity_change),
            1e-14);
}

}  // namespace after_impact_test
}  // namespace grapnel::testing
