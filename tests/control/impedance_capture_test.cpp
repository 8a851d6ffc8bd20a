/// Impedance and grasp forces in complete captures: the shipped scenarios, sampled control, rejected settings.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace impedance_capture_test {

using Joints = PostImpactSetup::Joints;

std::vector<std::string> faults(const CaptureProblem& p) {
  std::vector<std::string> messages;
  for (const ProblemFault& fault : problem_conflicts(p)) messages.push_back(fault.message);
  return messages;
}

CaptureProblem waiting_end_effector() {
  CaptureProblem p = scenario("impedance-capture.yaml");
  p.output_interval = 0.5;
  p.post_impact->duration = 10;
  return p;
}

// Without the law's spring and damper only the masses determine the result.
TEST(ImpedanceCapture, MatchedMassStopsTheSatellite) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = waiting_end_effector();
  p.impedance->damping = p.impedance->stiffness = {0, 0, 0};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_TRUE(r.impact() && r.impact()->effective_masses.size() == 1 && r.impact()->compliant);
  const EffectiveMass& m = r.impact()->effective_masses[0];
  std::printf("  hand %.3g kg, apparent %.4g, target %.4g, e %.3g: %.3g m/s, then %.2g; work %.3g J, residual %.2g\n",
              m.of_end_effector, m.apparent.value_or(NAN), m.of_target, m.restitution, m.target_speed_before,
              m.target_speed_after, r.impact()->compliant->motor_work, r.impact()->compliant->energy_residual);
  ASSERT_TRUE(m.apparent);
  EXPECT_NEAR(m.restitution * *m.apparent, m.of_target, 1e-9 * m.of_target);
  EXPECT_NEAR(m.target_speed_before, 0.02, 1e-8);
  EXPECT_LT(std::abs(m.target_speed_after), 0.02 * m.target_speed_before);
  EXPECT_GT(std::abs(r.impact()->compliant->motor_work), 1e-3);
  const LawReport* law = r.law(LawReport::Law::impedance);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->ended, LawEnd::running);
}

// A slow on-board computer: efforts are held between ticks, also during the contact.
TEST(ImpedanceCapture, SampledControlAgrees) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = waiting_end_effector();
  p.post_impact->duration = 1;
  const CaptureResult continuous = simulate_capture(p);
  p.control = ControlSetup{};
  p.control->timing.period = 0.02;
  const CaptureResult sampled = simulate_capture(p);
  expect_passes(sampled);
  ASSERT_TRUE(continuous.impact() && sampled.impact());
  const double a = continuous.impact()->effective_masses[0].target_speed_after,
               b = sampled.impact()->effective_masses[0].target_speed_after;
  std::printf("  speed afterwards %.3g m/s, sampled %.3g m/s\n", a, b);
  EXPECT_NE(a, b);
  EXPECT_NEAR(a, b, 2e-3);
}

CaptureProblem squeeze() {
  CaptureProblem p = scenario("dual-arm-squeeze.yaml");
  p.output_interval = 0.5;
  return p;
}

TEST(ImpedanceCapture, RejectsUnsupportedSettings) {
  using ::testing::Contains;
  using ::testing::HasSubstr;
  EXPECT_THAT(faults(waiting_end_effector()), ::testing::IsEmpty());
  EXPECT_THAT(faults(squeeze()), ::testing::IsEmpty());
  CaptureProblem p = waiting_end_effector();
  p.impedance->end_effectors = {"tip-3"};
  EXPECT_THAT(faults(p), Contains(HasSubstr("impedance.end_effectors names 'tip-3', which the robot does not have")));
  p = waiting_end_effector();
  p.impedance.reset();
  EXPECT_THAT(faults(p), Contains(HasSubstr("approach.tracking.mode is impedance, which needs its section")));
  p = waiting_end_effector();
  p.impact->law = ImpactSetup::Law::restitution;
  EXPECT_THAT(faults(p), Contains(HasSubstr("impact.joints is impedance, which needs law compliant")));
  p = waiting_end_effector();
  p.impedance->motion = ImpedanceSetup::Motion::pose;
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.name == "arm-1-joint-6" || body.joint.name == "arm-1-joint-7") body.joint.type = JointType::fixed;
  }
  EXPECT_THAT(faults(p), Contains(HasSubstr("needs at least 6 moving joints; the arm of 'tip-1' has 5")));
  p = waiting_end_effector();
  p.impedance->force = ImpedanceSetup::Force::not_sensed;
  EXPECT_THAT(faults(p), Contains(HasSubstr("needs law operational_space and force sensed")));
  p = squeeze();
  p.post_impact->grasp_force->pairs[0].between[1] = "tip-9";
  EXPECT_THAT(faults(p), Contains(HasSubstr("names 'tip-9', which does not hold 'satellite'; did you mean")));
  p = squeeze();
  p.grasps.pop_back();
  EXPECT_THAT(faults(p), Contains(HasSubstr("needs two grasps or more of one target")));
  p = squeeze();
  p.post_impact->joints = Joints::pd;
  EXPECT_THAT(faults(p), Contains(HasSubstr("post_impact.grasp_force requires joints: grasp_force; they are pd")));
}

}  // namespace impedance_capture_test
}  // namespace grapnel::testing
