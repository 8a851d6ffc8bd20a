/// Tendons in whole runs: closed forms under constant tension and while a tendon is wound up, the static equilibrium of
/// an underactuated finger between two walls, brakes, sequences of phases, and faults.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "capture/capture_case.hpp"
#include "capture/scenario_run.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/lanes/lane_phase_setup.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace tendons_test {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// ---- Two rotors and a slider on a fixed base, pulled by one tendon ----

constexpr double kInertia1 = 0.02, kInertia2 = 0.05, kMass = 0.4;
constexpr double kArm1 = 0.03, kArm2 = -0.02, kArm3 = 1;

std::string pulled(const std::string& motion, const std::string& stiffness = "") {
  const auto link = [](const char* name, const char* type, double inertia) {
    return fmt::format(
        "    - {{name: {0}, parent: base, mass: {1}, inertia: [{2}, {2}, {2}], joint: {{name: {0}, type: {3}, axis: "
        "[0, 0, 1]}}}}\n",
        name, kMass, inertia, type);
  };
  return "schema: grapnel-scenario/1\nname: pulled\nrobot:\n  name: pulled\n"
         "  base: {name: base, mode: fixed, mass: 10, inertia: [1, 1, 1]}\n  links:\n" +
         link("first", "revolute", kInertia1) + link("second", "revolute", kInertia2) +
         link("slider", "prismatic", 0.01) +
         fmt::format(
             "  tendons: [{{name: cord, joints: [{{joint: first, arm: {}}}, {{joint: second, arm: {}}}, {{joint: "
             "slider, arm: {}}}]{}}}]\n",
             kArm1, kArm2, kArm3, stiffness) +
         "initial: {joints: {first: 0.1, second: 0.2, slider: 0}}\n" + motion + "output: {interval: 0.1}\n";
}

// The compliance of the excursion: e'' = kMobility T.
constexpr double kMobility = kArm1 * kArm1 / kInertia1 + kArm2 * kArm2 / kInertia2 + kArm3 * kArm3 / kMass;

TEST(Tendon, AcceleratesItsJointsByItsMomentArms) {
  const double T = 5, t = 2;
  const CaptureResult r = run(pulled("motion: {duration: 2, tendons: [{tendon: cord, tension: 5}]}\n"));
  expect_sound(r);
  const std::vector<double>& end = r.post_impact_end->joints.position;
  EXPECT_NEAR(end[0], 0.1 + kArm1 * T / kInertia1 * t * t / 2, 1e-9);
  EXPECT_NEAR(end[1], 0.2 + kArm2 * T / kInertia2 * t * t / 2, 1e-9);
  EXPECT_NEAR(end[2], kArm3 * T / kMass * t * t / 2, 1e-9);
  const std::vector<double>& effort = series(r, "joints/effort").data;
  EXPECT_NEAR(effort[0], kArm1 * T, 1e-12);
  EXPECT_NEAR(effort[1], kArm2 * T, 1e-12);
  EXPECT_NEAR(effort[2], kArm3 * T, 1e-12);
  ASSERT_EQ(r.tendons.size(), 1u);
  const TendonReport& cord = r.tendons[0];
  EXPECT_EQ(cord.largest_tension, T);
  EXPECT_NEAR(cord.excursion_after - cord.excursion_before, kMobility * T * t * t / 2, 1e-9);
  EXPECT_NEAR(cord.work, T * kMobility * T * t * t / 2, 1e-8);
  EXPECT_NEAR(series(r, "tendons/excursion").data.back(), cord.excursion_after, 1e-12);
}

// While the tendon is wound up at the speed v, its stretch is v/w sin(w t) with w^2 = k kMobility. After half an
// oscillation it is slack, and its joints continue at twice the mean rate.
TEST(Tendon, IsWoundUpAndBecomesSlack) {
  const double k = 50, v = 0.1, w = std::sqrt(k * kMobility);
  const CaptureResult r = run(
      pulled("motion: {duration: 1, tendons: [{tendon: cord, tension: 1000, speed: 0.1}]}\n", ", stiffness: 50 N/m"));
  expect_sound(r);
  ASSERT_LT(M_PI / w, 0.5);
  const Series& tension = series(r, "tendons/tension");
  const Series& excursion = series(r, "tendons/excursion");
  const double start = kArm1 * 0.1 + kArm2 * 0.2;
  for (std::size_t i = 0; i < tension.data.size(); ++i) {
    const double t = 0.1 * static_cast<double>(i);
    const bool taut = w * t < M_PI;
    EXPECT_NEAR(tension.data[i], taut ? k * v / w * std::sin(w * t) : 0, 1e-7) << t;
    EXPECT_NEAR(excursion.data[i] - start, taut ? v * (t - std::sin(w * t) / w) : v * (2 * t - M_PI / w), 1e-8) << t;
  }
  EXPECT_NEAR(r.tendons[0].largest_tension, k * v / w, 1e-3);
  // All work has become kinetic energy: e' = 2 v of the generalized mass 1/kMobility.
  EXPECT_NEAR(r.tendons[0].work, 0.5 * (2 * v) * (2 * v) / kMobility, 1e-7);
}

TEST(Tendon, StopsAtItsMaximumTension) {
  const CaptureResult r =
      run(pulled("motion: {duration: 1, tendons: [{tendon: cord, tension: 0.5, speed: 1}]}\n", ", stiffness: 50 N/m"));
  expect_sound(r);
  EXPECT_EQ(r.tendons[0].largest_tension, 0.5);
  EXPECT_EQ(series(r, "tendons/tension").data[1], 0.5);
}

// A joint with a return spring comes to rest at r T = k q.
TEST(Tendon, PullsASprungJointToItsEquilibrium) {
  std::string text = pulled("motion: {duration: 8, tendons: [{tendon: cord, tension: 20}]}\n");
  const auto replace = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  replace("{joint: first, arm: 0.03}, ", "");
  replace(", {joint: slider, arm: 1}", "");
  replace("name: second, type: revolute", "name: second, spring: {stiffness: 2, damping: 0.5}, type: revolute");
  replace("second: 0.2, ", "");
  const CaptureResult r = run(text);
  expect_sound(r);
  const double q = kArm2 * 20 / 2;
  EXPECT_NEAR(series(r, "tendons/excursion").data.back(), kArm2 * q, 1e-9);
  EXPECT_NEAR(r.tendons[0].work, 20 * kArm2 * q, 1e-8);
}

TEST(Tendon, ContinuesInLaterPhases) {
  const CaptureResult r =
      run(pulled("motion:\n  - {duration: 1, joints: braked, tendons: [{tendon: cord, tension: 0.2, speed: 0.05}]}\n"
                 "  - {duration: 1, joints: pd, kp: 10, kd: 10}\n"
                 "  - {duration: 1, tendons: [{tendon: cord, tension: 0.3, speed: 1}]}\n",
                 ", stiffness: 200"));
  expect_sound(r);
  const std::vector<double>& tension = series(r, "tendons/tension").data;
  EXPECT_GT(tension[1], 0);  // not locked by the brakes
  EXPECT_GT(series(r, "tendons/excursion").data[10], 0.05);
  EXPECT_EQ(tension[15], 0);  // slack: the joints follow pd
  EXPECT_NEAR(tension.back(), 0.3, 1e-12);
  EXPECT_GT(r.post_impact_end->joints.position[2], 0.05);
}

// ---- A finger with two joints, between two walls ----

constexpr double kLength1 = 0.1, kPad1 = 0.06, kPad2 = 0.05, kFingerArm1 = 0.02, kFingerArm2 = 0.004;

std::string finger(const std::string& motion) {
  const auto wall = [](const char* name, double y) {
    return fmt::format("  - {{name: {}, half_space: true, position: [0, {}, 0], rpy: [90 deg, 0, 0]}}\n", name, y);
  };
  return fmt::format(
             "schema: grapnel-scenario/1\nname: finger\nrobot:\n  name: finger\n"
             "  base: {{name: palm, mode: fixed, mass: 10, inertia: [1, 1, 1]}}\n  links:\n"
             "    - {{name: proximal, parent: palm, mass: 0.05, com: [0.05, 0, 0], inertia: [2e-5, 5e-5, 5e-5], "
             "geometry: {{shape: sphere, radius: 0.01, position: [{0}, 0, 0]}}, joint: {{name: proximal, type: "
             "revolute, axis: [0, 0, 1], friction: {{viscous: 0.01}}}}}}\n"
             "    - {{name: distal, parent: proximal, mass: 0.04, com: [0.04, 0, 0], inertia: [2e-5, 4e-5, 4e-5], "
             "geometry: {{shape: sphere, radius: 0.01, position: [{1}, 0, 0]}}, joint: {{name: distal, type: revolute, "
             "axis: [0, 0, 1], origin: {{position: [{2}, 0, 0]}}, friction: {{viscous: 0.005}}}}}}\n"
             "  tendons: [{{name: flexor, joints: [{{joint: proximal, arm: {3}}}, {{joint: distal, arm: {4}}}], "
             "stiffness: 5e3}}]\n"
             "initial: {{joints: {{proximal: 0, distal: 0}}}}\n"
             "materials: [{{name: smooth, stiffness: 1e4, damping: 50, friction: 0}}]\nobstacles:\n",
             kPad1, kPad2, kLength1, kFingerArm1, kFingerArm2) +
         wall("near", 0.022) + wall("far", 0.049) +
         "contacts: {pairs: [[proximal, near], [distal, far]], material: smooth}\n" + motion +
         "output: {interval: 0.5}\n";
}

// Virtual work: r_i T = sum over the pads of N dy/dq_i.
TEST(UnderactuatedFinger, SharesItsTensionBetweenTwoContacts) {
  const double T = 20;
  const CaptureResult r =
      run(finger("motion: {duration: 4, tendons: [{tendon: flexor, tension: 20, speed: 5 mm/s}]}\n"));
  expect_sound(r);
  EXPECT_EQ(series(r, "tendons/tension").data.back(), T);
  const std::vector<double>& q = r.post_impact_end->joints.position;
  const double N1 = series(r, "contacts/proximal--near/normal_force").data.back();
  const double N2 = series(r, "contacts/distal--far/normal_force").data.back();
  const double reach = kPad2 * std::cos(q[0] + q[1]);
  EXPECT_GT(N1, 1);
  EXPECT_GT(N2, 1);
  EXPECT_NEAR(kFingerArm2 * T, N2 * reach, 1e-8);
  EXPECT_NEAR(kFingerArm1 * T, N1 * kPad1 * std::cos(q[0]) + N2 * (kLength1 * std::cos(q[0]) + reach), 1e-8);
  for (const double rate : r.post_impact_end->joints.velocity) EXPECT_NEAR(rate, 0, 1e-7);
}

// ---- Restrictions and faults ----

TEST(Tendons, AreIntegratedOnCores) {
  const test::TemporaryFolder folder;
  const CaptureSystem system = make_capture_system(load_scenario(
      folder.write("scenario.yaml", pulled("motion: {duration: 2, tendons: [{tendon: cord, tension: 5}]}\n"))));
  PhaseSetup setup;
  setup.tendons.resize(1);
  EXPECT_EQ(lanes::lane_obstacle(system.model, setup, IntegrationSetup{}), "tendons pull joints");
}

TEST(Tendons, PullOnlyFreeJoints) {
  const test::TemporaryFolder folder;
  const CaptureSystem system = make_capture_system(load_scenario(
      folder.write("scenario.yaml", pulled("motion: {duration: 2, tendons: [{tendon: cord, tension: 5}]}\n"))));
  PhaseSetup setup;
  setup.drives.resize(3);
  setup.tendons = {{.arms = {{0, system.model.joint_body(0).q, 0.1}}}};
  EXPECT_NO_THROW(PhaseDynamics(system.model, setup));
  setup.drives[0].control = JointControl::pd;
  EXPECT_THROW(PhaseDynamics(system.model, setup), std::invalid_argument);
}

std::vector<std::string> faults(const std::string& from, const std::string& to) {
  std::string text = pulled("motion: {duration: 2, tendons: [{tendon: cord, tension: 5}]}\n");
  text.replace(text.find(from), from.size(), to);
  return test::faults_of(text);
}

TEST(TendonFaults, OfTheRobotHaveTheirPlaces) {
  EXPECT_THAT(
      faults("{joint: first, arm", "{joint: fist, arm"),
      ElementsAre(AllOf(HasSubstr("scenario.yaml:10:"), HasSubstr("tendons[0].joints[0].joint: unknown joint 'fist'"),
                        HasSubstr("did you mean 'first'?"))));
  EXPECT_THAT(faults("joint: second, arm: -0.02", "joint: second, arm: 0"),
              ElementsAre(HasSubstr("tendons[0].joints[1].arm: is 0, so the tendon has no effect")));
  EXPECT_THAT(faults("joint: second, arm", "joint: first, arm"), ElementsAre(HasSubstr("is named twice")));
  EXPECT_THAT(faults("slider, arm: 1", "slider, arm: 1 mm"), ElementsAre(HasSubstr("joint 'slider' slides")));
  EXPECT_THAT(faults("arm: 0.03", "arm: 30 deg"), ElementsAre(HasSubstr("expected a length")));
  EXPECT_THAT(faults("name: second, type: revolute", "name: second, mimic: {joint: first}, type: revolute"),
              Contains(HasSubstr("joint 'second' follows 'first'; state the moment arm at the joint that it follows")));
}

TEST(TendonFaults, OfCommandsHaveTheirPlaces) {
  EXPECT_THAT(faults("tendon: cord", "tendon: chord"),
              ElementsAre(AllOf(HasSubstr("motion.tendons[0].tendon: the robot has no tendon 'chord'"),
                                HasSubstr("did you mean 'cord'?"))));
  EXPECT_THAT(faults("tension: 5}", "tension: 5, speed: 1 mm/s}"),
              ElementsAre(HasSubstr("motion.tendons[0].speed needs the stiffness of tendon 'cord'")));
  EXPECT_THAT(faults("tension: 5}", "tension: 5}, {tendon: cord, tension: 1}"),
              ElementsAre(HasSubstr("motion.tendons[1].tendon: 'cord' has two commands in this phase")));
  EXPECT_THAT(faults("tension: 5}", "tension: -5}"), ElementsAre(HasSubstr("tension")));
  const std::vector<std::string> later =
      test::faults_of(pulled("motion:\n  - {duration: 1}\n  - {duration: 1, tendons: [{tendon: rope, tension: 1}]}\n"));
  EXPECT_THAT(later, ElementsAre(HasSubstr("motion[1].tendons[0].tendon: the robot has no tendon 'rope'")));
  EXPECT_THAT(faults("tendons: [{tendon: cord",
                     "joints: detumble, kp: 1, kd: 1, detumble: {torque: 1}, tendons: "
                     "[{tendon: cord"),
              Contains(HasSubstr("motion.tendons: joints detumble commands all joints")));
}

}  // namespace tendons_test
}  // namespace grapnel::testing
