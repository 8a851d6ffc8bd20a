/// The captured system's joints under control: computed torque that knows what is held, and moves to a posture.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/capture_case.hpp"
#include "grapnel/problem/problem_conflicts.hpp"

namespace grapnel::testing {
namespace posture_move_test {

constexpr double kBegin = 10, kAfter = 4, kDuration = 12;  // [s]

CaptureProblem with_move(PostImpactSetup::Joints joints) {
  CaptureProblem p = thesis_case_pd();
  p.approach->duration = kBegin;
  p.targets[0].V_WT = {{0.1, -0.05, 0.2}, {0.01, 0, 0.02}};  // out of the plane, too
  p.targets[1].V_WT.angular = {0.02, 0.1, -0.2};
  p.momentum = Momentumd{{1, 2, 3}, {3, -2, 1}};
  p.post_impact.emplace();
  p.post_impact->duration = 60;
  p.post_impact->joints = joints;
  const bool is_pd = joints == PostImpactSetup::Joints::pd;
  p.post_impact->kp.assign(6, is_pd ? 60 : 0.49);
  p.post_impact->kd.assign(6, is_pd ? 120 : 0.98);  // with computed torque a damping ratio of 0.7
  p.post_impact->move = PostureMove{{0.2, -0.4, 0.6, -0.1, 0.5, -0.9}, kAfter, kDuration, JointProfile::quintic};
  p.output_interval = 0.5;
  return p;
}

// Where a joint's reference is: from `start`, at rest, to `end`, at rest; the quintic 10 s^3 - 15 s^4 + 6 s^5.
double reference(double start, double end, double t) {
  const double s = std::clamp((t - kBegin - kAfter) / kDuration, 0.0, 1.0);
  return start + (end - start) * s * s * s * (10 + s * (-15 + 6 * s));
}

// The impact leaves a joint its rate: the error e of q'' = r'' - kd e' - kp e is that of a damped oscillator that is
// struck, whatever the captured bodies are and however the base turns.
TEST(ComputedTorque, ErrorsOfCapturedSystemDecayByGains) {
  const CaptureProblem p = with_move(PostImpactSetup::Joints::computed_torque);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const double decay = 0.49, frequency = std::sqrt(0.49 - decay * decay);
  const std::size_t s = first_sample(r, "post_impact");
  double largest = 0;
  for (std::size_t i = s; i < r.series.time.size(); ++i) {
    const double t = r.series.time[i] - kBegin;
    for (int j = 0; j < 6; ++j) {
      const double start = value_at(r, "joints/position", s, j), rate = value_at(r, "joints/velocity", s, j);
      const double error = rate / frequency * std::exp(-decay * t) * std::sin(frequency * t);
      const double expected = reference(start, p.post_impact->move->joints[j], r.series.time[i]) + error;
      EXPECT_NEAR(value_at(r, "joints/position", i, j), expected, 1e-10);
      EXPECT_NEAR(value_at(r, "joints/reference_position", i, j), expected - error, 1e-14);
      largest = std::max(largest, std::abs(error));
    }
  }
  EXPECT_GT(largest, 1e-3);  // the impact did strike them
}

TEST(Pd, MovesToPostureAndHolds) {
  const CaptureProblem p = with_move(PostImpactSetup::Joints::pd);
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t end = r.series.time.size() - 1;
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(value_at(r, "joints/position", end, j), p.post_impact->move->joints[j], 0.02);
    EXPECT_GT(
        std::abs(value_at(r, "joints/position", first_sample(r, "post_impact"), j) - p.post_impact->move->joints[j]),
        0.1);
  }
  const Vector3d L0 = vector_at(r, "system/angular_momentum", 0), L1 = vector_at(r, "system/angular_momentum", end);
  EXPECT_LT(norm(L1 - L0), 1e-11 * r.ledger.scale.angular_momentum);  // motors are inside
}

// Joints of an arm that holds its target early wait for the end of the approach.
TEST(AMove, StartsAtBeginOfPostImpact) {
  CaptureProblem p = with_move(PostImpactSetup::Joints::computed_torque);
  p.grasps[0].closes = GraspSetup::Closes::at_time;
  p.grasps[0].closes_at = 5;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    const double t = r.series.time[i];
    if (t > 5 && t < kBegin + kAfter && i < first_sample(r, "contact_2")) {
      EXPECT_EQ(value_at(r, "joints/reference_velocity", i, 0), 0) << t;
    }
  }
  EXPECT_EQ(value_at(r, "joints/reference_position", r.series.time.size() - 1, 0), 0.2);
}

std::vector<std::string> conflicts(const CaptureProblem& p) {
  std::vector<std::string> texts;
  for (const ProblemFault& fault : problem_conflicts(p)) texts.push_back(fault.message);
  return texts;
}

TEST(AMove, RejectsInvalidMove) {
  using ::testing::ElementsAre;
  CaptureProblem p = with_move(PostImpactSetup::Joints::braked);
  p.post_impact->move->duration = 57;
  EXPECT_THAT(
      conflicts(p),
      ElementsAre("post_impact.move: joints that are braked follow no reference; use joints: pd or computed_torque",
                  "post_impact.move ends after 61 [s], must end within post_impact's 60"));
  p = with_move(PostImpactSetup::Joints::computed_torque);
  p.grasps[1].target = p.grasps[0].target;
  EXPECT_THAT(conflicts(p),
              ElementsAre("post_impact.joints is computed_torque, but grasps[0] and grasps[1] hold one target, and "
                          "joints of a closed loop cannot be accelerated independently; use pd"));
  p = with_move(PostImpactSetup::Joints::pd);
  p.post_impact->move->joints.pop_back();
  EXPECT_THROW(simulate_capture(p), CaptureProblemError);
}

}  // namespace posture_move_test
}  // namespace grapnel::testing
