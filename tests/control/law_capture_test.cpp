/// Control laws in complete captures: the shipped scenario, the end of a law, rejected settings.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "capture/capture_case.hpp"
#include "capture/loop_case.hpp"
#include "grapnel/campaign/column.hpp"
#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace law_capture_test {

using Joints = PostImpactSetup::Joints;

// Both arms in a closed loop, with friction known to the law; starts at the end of the approach.
CaptureProblem shipped() {
  CaptureProblem p = scenario("dual-arm-detumbling.yaml");
  p.output_interval = 0.5;
  return p;
}

// A short motion: one arm, with the capture at the start.
CaptureProblem one_arm() {
  CaptureProblem p = scenario("seven-joint-dual-capture.yaml");
  p.approach->duration = 5;
  p.output_interval = 0.5;
  PostImpactSetup& post = *p.post_impact;
  post.duration = 20;
  post.joints = Joints::detumble;
  post.kp.assign(14, 300), post.kd.assign(14, 200);
  post.detumble = DetumbleSetup{0.005, "box-80"};
  return p;
}

std::vector<std::string> faults(const CaptureProblem& p) {
  std::vector<std::string> messages;
  for (const ProblemFault& fault : problem_conflicts(p)) messages.push_back(fault.message);
  return messages;
}

TEST(DetumblingCapture, BothArmsBringTheShippedSatelliteToRest) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult r = simulate_capture(shipped());
  expect_passes(r);
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  const LawReport& d = *law;
  EXPECT_EQ(d.ended, LawEnd::at_rest);
  EXPECT_NEAR(d.end - d.begin, d.expected_duration * (1 - 1e-6), 1e-9 * d.expected_duration);  // a millionth remains
  EXPECT_NEAR(d.largest_torque, d.torque_bound, 1e-11);
  EXPECT_GT(d.angular_momentum_before, 1);
  EXPECT_EQ(d.least_share, 1);
  EXPECT_GT(d.least_condition, 0.01);
  // Afterwards the joints hold: little relative motion.
  const std::size_t last = r.series.time.size() - 1;
  EXPECT_LT(norm(vector_at(r, "targets/satellite/angular_velocity", last)), 1e-3);
}

// Motion and report are equal with and without samples and loads.
TEST(DetumblingCapture, IsIndependentOfDetailColumns) {
  SKIP_UNDER_SANITIZERS();
  const CaptureProblem p = one_arm();
  const CaptureResult full = simulate_capture(p), columns = simulate_capture(p, {}, CaptureDetail::columns);
  ASSERT_EQ(full.status, CaptureStatus::completed) << full.failure;
  const LawReport* law = full.law(LawReport::Law::detumbling);
  const LawReport* law_of_columns = columns.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law && law_of_columns);
  EXPECT_EQ(law->end, law_of_columns->end);
  EXPECT_EQ(law->angular_momentum_after, law_of_columns->angular_momentum_after);
  EXPECT_EQ(law->largest_torque, law_of_columns->largest_torque);
  EXPECT_EQ(full.post_impact_end->base.angular_velocity[0], columns.post_impact_end->base.angular_velocity[0]);
}

// Flexible panels: the target is braked as a rigid body in its present shape.
TEST(DetumblingCapture, BringsATargetWithPanelsToRest) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("dual-arm-satellite-panels.yaml");
  p.output_interval = 1;
  PostImpactSetup& post = *p.post_impact;
  post.joints = Joints::detumble, post.detumble = DetumbleSetup{0.2, ""};
  post.base_control.emplace();
  post.base_control->kd = {400, 400, 400}, post.base_control->limit = {5, 5, 5};
  const CaptureResult r = simulate_capture(p, {}, CaptureDetail::columns);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  std::printf("  %.3g N m s before, %.3g after, %.4g s of %.4g\n", law->angular_momentum_before,
              law->angular_momentum_after, law->end - law->begin, law->expected_duration);
  EXPECT_EQ(law->ended, LawEnd::at_rest);
  EXPECT_GT(law->angular_momentum_before, 1);
  EXPECT_LT(law->angular_momentum_after, 2e-6 * law->angular_momentum_before);
  EXPECT_NEAR(law->end - law->begin, law->expected_duration, 0.02 * law->expected_duration);
}

// Not supported in lanes; the columns of studies and campaigns contain the values of the report.
TEST(DetumblingCapture, InStudiesAndCampaigns) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = one_arm();
  p.clearance.enabled = false;
  CaptureSteps steps(p, CaptureDetail::columns);
  std::vector<std::string> reasons;
  while (const MotionTask* task = steps.next()) reasons.push_back(task->phase + ": " + task->only_here);
  EXPECT_THAT(reasons, ::testing::Contains("post_impact: a law moves the joints together"));
  const CaptureResult r = steps.finish();
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  const StudyCase point{p, {}};
  const LawReport& d = *law;
  const std::map<std::string, double> expected{{"detumbling/at_rest", d.ended == LawEnd::at_rest},
                                               {"detumbling/duration", d.end - d.begin},
                                               {"detumbling/largest_torque", d.largest_torque},
                                               {"detumbling/least_scale", d.least_share}};
  EXPECT_NEAR(d.largest_torque, 0.005, 1e-12);
  std::size_t found = 0;
  for (const Column& column : standard_columns(p, true)) {
    const auto at = expected.find(column.name);
    if (at == expected.end()) continue;
    EXPECT_EQ(column.value(point, r), at->second) << column.name;
    ++found;
  }
  EXPECT_EQ(found, expected.size());
}

TEST(DetumblingCapture, EndsAtAJointStopOrRelease) {
  CaptureProblem p = one_arm();
  p.post_impact->releases.push_back({6, {"tip-2"}});
  CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->ended, LawEnd::released);
  EXPECT_NEAR(law->end, 11, 1e-9);
  const double free_momentum = law->angular_momentum_after;
  EXPECT_GT(free_momentum, 0.05);
  EXPECT_NEAR(free_momentum, law->angular_momentum_before - 0.005 * 6, 1e-9);

  p = one_arm();
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.name.starts_with("arm-2-joint")) body.joint.limits.lower = -3.2, body.joint.limits.upper = 3.2;
  }
  const std::size_t first = first_sample(r, "post_impact");
  int moving = 0;  // the joint with the largest motion, and its value after 3 s
  double most = 0;
  for (int j = 7; j < 14; ++j) {
    const double turn = value_at(r, "joints/position", first + 6, j) - value_at(r, "joints/position", first, j);
    if (std::abs(turn) > std::abs(most)) most = turn, moving = j;
  }
  const double stop = value_at(r, "joints/position", first + 6, moving);
  const std::string name = series(r, "joints/position").components[static_cast<std::size_t>(moving)];
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.name == name) (most > 0 ? body.joint.limits.upper : body.joint.limits.lower) = stop;
  }
  r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->ended, LawEnd::joint_limit);
  EXPECT_EQ(law->joint, name);
  EXPECT_NEAR(law->end, 8, 0.02);
}

TEST(BaseKeepingCapture, BaseReturnsToItsAttitude) {
  CaptureProblem p = one_arm();
  p.post_impact->joints = Joints::keep_base_attitude;
  p.post_impact->detumble.reset();
  p.post_impact->keep_base_attitude = KeepBaseSetup{};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const LawReport* law = r.law(LawReport::Law::base_keeping);
  ASSERT_TRUE(law);
  const LawReport& b = *law;
  EXPECT_EQ(b.ended, LawEnd::running);
  EXPECT_EQ(b.rank, 3);
  EXPECT_GT(b.largest_angle, 1e-4);  // rotated by the impact
  EXPECT_LT(b.angle_after, 0.05 * b.largest_angle);
  EXPECT_LT(b.angular_velocity_after, 1e-4);
}

TEST(Laws, RejectUnsupportedSettings) {
  using ::testing::ElementsAre;
  using ::testing::HasSubstr;
  EXPECT_THAT(faults(one_arm()), ::testing::IsEmpty());
  CaptureProblem p = one_arm();
  p.post_impact->detumble->target = "";
  EXPECT_THAT(faults(p),
              ElementsAre(HasSubstr("the grasps hold 2 targets; name one with 'target', 'box-120' or 'box-80'")));
  p.post_impact->detumble->target = "box-8";
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("'box-8', which no grasp holds; did you mean 'box-80'?")));
  p = one_arm();
  p.grasps[1].model = GraspModel::point;
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("no grasp of 'box-80' is rigid")));
  p = one_arm();
  p.post_impact->kd[3] = 0;
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("post_impact.kd must be above 0 with joints: detumble")));
  p = one_arm();
  for (const char* joint : {"arm-2-joint-6", "arm-2-joint-7"}) {
    for (BodyDescription& body : p.robot.bodies) {
      if (body.joint.name == joint) body.joint.type = JointType::fixed;
    }
  }
  EXPECT_THAT(faults(p), ::testing::Contains(HasSubstr(
                             "the arm of grasps[1] has 5 moving joints; the six motions of 'box-80' need at least 6")));
  p = one_arm();
  p.post_impact->joints = Joints::pd;
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("post_impact.detumble requires joints: detumble; they are pd")));
  p = one_arm();
  p.post_impact->joints = Joints::keep_base_attitude;
  p.post_impact->detumble.reset();
  p.post_impact->base_control = BaseControlSetup{};
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("the joints already control the base's attitude")));
  p = shipped();
  p.post_impact->joints = Joints::keep_base_attitude;
  p.post_impact->detumble.reset(), p.post_impact->base_control.reset();
  EXPECT_THAT(faults(p), ElementsAre(HasSubstr("this law does not support closed loops; use detumble or pd")));
}

}  // namespace law_capture_test
}  // namespace grapnel::testing
