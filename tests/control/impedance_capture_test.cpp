/// Impedance and grasp forces in whole captures: the shipped scenarios, sampled control, what is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "grapnel/problem/problem_conflicts.hpp"

namespace grapnel::testing {
namespace impedance_capture_test {

using Joints = PostImpactSetup::Joints;

std::vector<std::string> faults(const CaptureProblem& p) {
  std::vector<std::string> messages;
  for (const ProblemFault& fault : problem_conflicts(p)) messages.push_back(fault.message);
  return messages;
}

CaptureProblem waiting_hand() {
  CaptureProblem p = scenario("impedance-capture.yaml");
  p.output_interval = 0.5;
  p.post_impact->duration = 10;
  return p;
}

TEST(ImpedanceCapture, TheShippedSatelliteIsStopped) {
  CaptureProblem p = waiting_hand();
  p.impedance->damping = p.impedance->stiffness = {0, 0, 0};  // the masses alone
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_TRUE(r.impact && r.impact->effective_masses.size() == 1 && r.impact->compliant);
  const EffectiveMass& m = r.impact->effective_masses[0];
  std::printf("  hand %.3g kg, apparent %.4g, target %.4g, e %.3g: %.3g m/s, then %.2g; work %.3g J, residual %.2g\n",
              m.hand, m.apparent.value_or(NAN), m.of_target, m.restitution, m.target_speed_before, m.target_speed_after,
              r.impact->compliant->motor_work, r.impact->compliant->energy_residual);
  ASSERT_TRUE(m.apparent);
  EXPECT_NEAR(m.restitution * *m.apparent, m.of_target, 1e-9 * m.of_target);
  EXPECT_GT(m.target_speed_before, 0.02);
  EXPECT_LT(std::abs(m.target_speed_after), 0.02 * m.target_speed_before);
  EXPECT_GT(std::abs(r.impact->compliant->motor_work), 1e-3);
  ASSERT_TRUE(r.impedance);
  EXPECT_EQ(r.impedance->ended, LawEnd::running);
}

TEST(ImpedanceCapture, ApproachArrivesAndHandStaysNearItsReference) {
  const CaptureResult r = simulate_capture(waiting_hand());
  expect_passes(r);
  ASSERT_TRUE(r.approach_impedance && r.impedance);
  std::printf("  approach: largest %.2g m, at the end %.2g m; afterwards %.2g m, %.2g m\n",
              r.approach_impedance->largest_distance, r.approach_impedance->distance_after,
              r.impedance->largest_distance, r.impedance->distance_after);
  EXPECT_EQ(r.approach_impedance->ended, LawEnd::running);
  EXPECT_LT(r.approach_impedance->distance_after, 1e-6);
  EXPECT_GT(r.approach_impedance->least_condition, 1e-3);
}

// An on-board computer at 100 Hz: efforts are held between ticks, during the contact too.
TEST(ImpedanceCapture, SampledNearlyTheSame) {
  CaptureProblem p = waiting_hand();
  p.approach->duration = 45;
  const CaptureResult continuous = simulate_capture(p);
  p.control = ControlSetup{};
  p.control->timing.period = 0.01;
  const CaptureResult sampled = simulate_capture(p);
  expect_passes(sampled);
  const double a = continuous.impact->effective_masses[0].target_speed_after,
               b = sampled.impact->effective_masses[0].target_speed_after;
  std::printf("  speed afterwards %.3g m/s, sampled %.3g m/s\n", a, b);
  EXPECT_NE(a, b);
  EXPECT_NEAR(a, b, 2e-3);
}

CaptureProblem squeeze() {
  CaptureProblem p = scenario("dual-arm-squeeze.yaml");
  p.output_interval = 0.5;
  return p;
}

TEST(GraspForceCapture, TheShippedSatelliteIsSqueezedAndStays) {
  const CaptureResult r = simulate_capture(squeeze());
  expect_passes(r);
  ASSERT_TRUE(r.grasp_force);
  const GraspForceReport& g = *r.grasp_force;
  ASSERT_EQ(g.pairs.size(), 1u);
  std::printf("  force %.9g of %.9g N, largest error %.2g N, others %.2g N, target off by %.2g m\n", g.pairs[0].force,
              g.pairs[0].reference, g.pairs[0].largest_error, g.other_internal_force, g.largest_distance);
  EXPECT_EQ(g.ended, LawEnd::running);
  EXPECT_NEAR(g.pairs[0].reference, 20, 1e-12);
  EXPECT_LT(g.pairs[0].largest_error, 1e-5);
  EXPECT_LT(g.other_internal_force, 1e-5);
  EXPECT_EQ(g.internal_rank, 6);
  EXPECT_TRUE(g.within_limits);
}

TEST(ImpedanceCapture, RefusesWhatItCannotDo) {
  using ::testing::Contains;
  using ::testing::HasSubstr;
  EXPECT_THAT(faults(waiting_hand()), ::testing::IsEmpty());
  EXPECT_THAT(faults(squeeze()), ::testing::IsEmpty());
  CaptureProblem p = waiting_hand();
  p.impedance->end_effectors = {"tip-3"};
  EXPECT_THAT(faults(p), Contains(HasSubstr("impedance.end_effectors names 'tip-3', which the robot does not have")));
  p = waiting_hand();
  p.impedance.reset();
  EXPECT_THAT(faults(p), Contains(HasSubstr("approach.tracking.mode is impedance, which needs its section")));
  p = waiting_hand();
  p.impact->law = ImpactSetup::Law::restitution;
  EXPECT_THAT(faults(p), Contains(HasSubstr("impact.joints is impedance, which belongs to law compliant")));
  p = waiting_hand();
  p.impedance->motion = ImpedanceSetup::Motion::pose;
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.name == "arm-1-joint-6" || body.joint.name == "arm-1-joint-7") body.joint.type = JointType::fixed;
  }
  EXPECT_THAT(faults(p), Contains(HasSubstr("takes 6 moving joints or more; the arm of 'tip-1' has 5")));
  p = waiting_hand();
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
  EXPECT_THAT(faults(p), Contains(HasSubstr("post_impact.grasp_force belongs to joints: grasp_force; they are pd")));
}

// The planar robot of Tohoku University: what yielding by impedance does to the peak force.
TEST(ImpedanceCapture, YieldingLowersThePeakOfThePlanarContact) {
  CaptureProblem p = scenario("planar-admittance.yaml");
  const auto peak = [&](ImpactSetup::Joints joints) {
    p.impact->joints = joints;
    if (joints != ImpactSetup::Joints::impedance) p.post_impact->joints = Joints::free, p.impedance.reset();
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    return r.impact->grasps[0].profile->peak_force;
  };
  const double yielding = peak(ImpactSetup::Joints::impedance), free = peak(ImpactSetup::Joints::free);
  const double stiff = peak(ImpactSetup::Joints::driven);
  std::printf("  peak force: impedance %.4g N, free %.4g N, driven %.4g N\n", yielding, free, stiff);
  EXPECT_LT(yielding, free);
  EXPECT_LT(free, stiff);
}

}  // namespace impedance_capture_test
}  // namespace grapnel::testing
