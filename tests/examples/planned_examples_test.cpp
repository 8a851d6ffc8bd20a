// Planned approaches of shipped scenarios, by the tests' own kinematics, and changed scenarios.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "capture/scene_check.hpp"
#include "examples/shipped_scenarios.hpp"
#include "examples/written_kinematics.hpp"
#include "grapnel/approach/capture_window.hpp"

namespace grapnel::testing {
namespace examples_test {

// A search that starts from the solution at the previous time may fail where other initial guesses succeed. If it fails
// without a cause, the other guesses are tried.
TEST(CaptureWindow, FindsTimesReachedByOtherGuesses) {
  const CaptureTime chosen = choose_capture_time(
      load("tumbling-window", {{"initial.base.momentum", "{linear: [0, 0, 0], angular: [0, 0, 0]}"}}));
  for (const WindowPoint& point : chosen.window.points)
    EXPECT_EQ(point.reachable, point.time > 76 && point.time < 97.5) << point.time << ": " << point.reason;
}

class Planned : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Examples, Planned, ::testing::ValuesIn(kPlanned), name_of_test);

// Ideal tracking without noise: at T the end-effectors have the planned positions and velocities, by the tests' own
// kinematics.
TEST_P(Planned, EveryEndEffectorReachesGraspPoint) {
  CaptureProblem p = load(GetParam(), {{"approach.tracking", "{mode: ideal}"}, {"approach.capture_at", "end"}});
  p.impact.reset();
  p.post_impact.reset();
  for (GraspSetup& grasp : p.grasps) grasp.closes = GraspSetup::Closes::together;  // as planned
  if (p.approach->window) {  // fixed from here on, with a sample at the start of the final straight approach
    p = choose_capture_time(p).problem;
    p.output_interval = (p.approach->duration - p.approach->straight_in->duration) / 800;
  }
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_TRUE(r.ledger.feasible());
  ASSERT_TRUE(r.approach_end);
  const double T = p.approach->duration;
  EXPECT_EQ(r.approach_end->time, T);
  const StraightIn in = p.approach->straight_in.value_or(StraightIn{});  // none: the last instant is evaluated
  const double begin = T - in.duration;
  const Vector3d drift = (1 / written_mass(p.robot)) * p.momentum->linear;
  const Vector3d com_at_start = written_com(p.robot, written_poses(p.robot, r, 0));

  double worst_miss = 0, worst_angle = 0, worst_across = 0, worst_com = 0, worst_speed = 0, largest_speed = 0;
  std::vector<double> before(p.grasps.size());  // distance from the grasp point one sample earlier
  const std::size_t samples = r.series.time.size();
  int begins = 0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = r.series.time[k];
    const auto poses = written_poses(p.robot, r, k);
    worst_com = std::max(worst_com, norm(written_com(p.robot, poses) - com_at_start - t * drift));
    if (t < begin - 1e-9) continue;
    for (std::size_t i = 0; i < p.grasps.size(); ++i) {
      const GraspSetup& grasp = p.grasps[i];
      const GraspPoint& point = point_of(p, grasp);
      const Posed X_WE = written_end_effector(p.robot, poses, grasp.end_effector);
      const Posed X_WT = pose_at(r, "targets/" + grasp.target, k);
      const Vector3d offset = transposed_times(X_WT.R, X_WE.p - X_WT * point.X_TG.p);  // from the grasp point, in T
      const double along = dot(offset, *point.approach_direction);
      worst_across = std::max(worst_across, norm(offset - along * *point.approach_direction));
      const EndEffectorSetup& gripper = *std::find_if(p.robot.end_effectors.begin(), p.robot.end_effectors.end(),
                                                      [&](const auto& e) { return e.name == grasp.end_effector; });
      const Vector3d reach = X_WE.R * *gripper.approach_axis, direction = X_WT.R * *point.approach_direction;
      worst_angle = std::max(worst_angle, norm(cross(reach, direction)));
      EXPECT_GT(dot(reach, direction), 0);
      if (std::abs(t - begin) < 1e-9) {
        EXPECT_NEAR(along, -in.stand_off, 1e-9);
        ++begins;
      }
      if (k + 1 == samples) {
        worst_miss = std::max(worst_miss, norm(offset));
        const double step = t - r.series.time[k - 1];
        EXPECT_NEAR((along - before[i]) / step, in.final_speed,
                    0.01 * in.final_speed + 1e-4);  // 0.4 %, due to the jerk
        const EndEffectorMotion& end = r.approach_end->end_effectors[i];
        ASSERT_EQ(end.name, grasp.end_effector);
        EXPECT_NEAR(end.miss_distance, norm(offset), 1e-12);
        worst_speed = std::max(worst_speed, norm(end.relative_velocity - in.final_speed * direction));
        largest_speed = std::max(largest_speed, norm(end.velocity));
      }
      before[i] = along;
    }
  }
  EXPECT_EQ(begins, static_cast<int>(p.grasps.size()));
  EXPECT_LT(worst_miss, 1e-9);               // measured 9e-13
  EXPECT_LT(worst_angle, 1e-9);              // measured 2e-12
  EXPECT_LT(worst_across, 1e-9);             // measured 3e-12
  EXPECT_LT(worst_com, 1e-10);               // measured 3e-16
  EXPECT_LT(worst_speed, 1e-9);              // measured 2e-12
  EXPECT_GT(largest_speed, in.final_speed);  // the grasp points move
  std::printf(
      "[ measured ] miss %.2g m, angle %.2g, across %.2g m, speed %.2g m/s, centre of mass %.2g m, hands at up to %.3f "
      "m/s\n",
      worst_miss, worst_angle, worst_across, worst_speed, worst_com, largest_speed);
}

// ---- Infeasible captures ----

CaptureResult failing(const std::string& name, const std::vector<Override>& overrides) {
  const CaptureResult r = simulate_capture(load(name, overrides));
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_FALSE(r.captured());
  EXPECT_FALSE(r.impact());
  EXPECT_THAT(schema_faults(r), ::testing::IsEmpty());
  return r;
}

TEST(ExamplesOutOfReach, FailBeforeMotionAndNameArm) {
  const CaptureResult heavy =
      failing("heavy-satellite-flat-spin", {{"targets.satellite.state.position", "[-0.3, 0.4, 9.9]"}});
  EXPECT_NE(heavy.failure.find("end-effector 'hand' comes no closer than"), std::string::npos) << heavy.failure;
  EXPECT_NE(heavy.failure.find("the arm is at most 5.354 m long"), std::string::npos) << heavy.failure;
  // One of six arms is out of reach.
  const CaptureResult six = failing("six-arm-servicer", {{"targets.tank.state.position", "[1.9, 2.9, 0.333]"}});
  EXPECT_NE(six.failure.find("end-effector 'hand-2' comes no closer than"), std::string::npos) << six.failure;
  for (const char* other : {"'hand-1'", "'hand-3'", "'hand-4'", "'hand-5'", "'hand-6'"}) {
    EXPECT_EQ(six.failure.find(other), std::string::npos) << six.failure;
  }
}

// A shoulder with a rate limit below the required rate: conservation checks pass, but the capture is infeasible.
TEST(ExamplesWithASlowJoint, ExceedRateLimit) {
  const CaptureResult r =
      simulate_capture(load("dual-arm-tumbling-targets", {{"robot.links.arm-1-link-1.joint.limits.rate", "0.02"},
                                                          {"approach.tracking", "{mode: ideal}"}}));
  expect_passes(r);
  EXPECT_TRUE(r.captured());
  EXPECT_FALSE(r.ledger.feasible());
  EXPECT_GT(row(r, "joint_rate_violation").value, 0.01);  // measured 0.038 rad/s
  for (const LimitEvent& e : r.limit_events) EXPECT_EQ(e.joint, "arm-1-joint-1");
}

// The thesis's final requirements: the four cases end at rest, with the attitude and the posture before the approach.
// Without base control the arms come to rest relative to the base, and the remaining momentum persists.
TEST(Stabilized, ThesisCasesEndAtRest) {
  for (const char* name : {"1", "2", "3", "4"}) {
    const CaptureProblem p = load("thesis/open-loop-case-" + std::string(name) + "-stabilized");
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    expect_passes(r);
    const std::size_t last = r.series.time.size() - 1, met = first_sample(r, "contact");
    const auto turned = [&](std::size_t sample) {
      return rotation_angle(transpose(p.X_WB.R) * pose_at(r, "base", sample).R);
    };
    EXPECT_GT(turned(met), 0.5) << name;    // the approach turns the base; measured 0.65 to 0.7 rad
    EXPECT_LT(turned(last), 1e-6) << name;  // measured 4e-9 rad
    EXPECT_LT(norm(r.post_impact_end->base.angular_velocity), 1e-7) << name;
    EXPECT_LT(norm(r.post_impact_end->base.velocity), 1e-8) << name;
    for (std::size_t j = 0; j < p.joint_position.size(); ++j) {
      EXPECT_NEAR(r.post_impact_end->joints.position[j], p.joint_position[j], 1e-6) << name;
      EXPECT_LT(std::abs(r.post_impact_end->joints.velocity[j]), 1e-6) << name;
    }
    CaptureProblem arms_alone = p;
    arms_alone.post_impact->base_control.reset();
    const CaptureResult alone = simulate_capture(arms_alone);
    expect_passes(alone);
    for (const double rate : alone.post_impact_end->joints.velocity) EXPECT_LT(std::abs(rate), 1e-6) << name;
  }
}

// The effect of five minutes in orbit on a stack of two bodies, as the file states; without the orbit there is none.
TEST(Orbit, RotatesStackOfTwoBodies) {
  const CaptureResult r = simulate_capture(load("orbit-drift"));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  const std::size_t last = r.series.time.size() - 1;
  const auto turned = [](const CaptureResult& result) {
    return rotation_angle(transpose(pose_at(result, "base", 0).R) *
                          pose_at(result, "base", result.series.time.size() - 1).R);
  };
  EXPECT_NEAR(norm(vector_at(r, "system/external_angular_impulse", last)), 27.7, 0.1);
  EXPECT_NEAR(turned(r) * 180 / 3.141592653589793, 4.7, 0.1);
  // Air drag: 1.9e-4 N/m^2 on at most 10 m^2 for 300 s.
  const Vector3d impulse = vector_at(r, "system/external_impulse", last);
  EXPECT_LT(dot(impulse, Vector3d{0, 1, 0}), -0.1);
  EXPECT_GT(dot(impulse, Vector3d{0, 1, 0}), -0.57);
  CaptureProblem alone = load("orbit-drift");
  alone.orbit.reset(), alone.loads.clear();
  EXPECT_EQ(turned(simulate_capture(alone)), 0);
}

}  // namespace examples_test
}  // namespace grapnel::testing
