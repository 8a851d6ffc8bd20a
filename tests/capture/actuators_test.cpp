/// All actuators together after a capture: thrusters, wheels and joints, in the balances of momentum and energy.

#include <gtest/gtest.h>

#include <cmath>

#include "capture/capture_case.hpp"
#include "capture/loop_case.hpp"
#include "capture/recorded.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace actuators_test {

// Wheels about inclined axes turn a hundred times per step, some at their rate limits, while thrusters fire pulses
// against them. Rounding errors in their transverse inertia must not act as a torque.
TEST(Actuators, FastWheelsConserveMomentum) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("detumble-envisat.yaml");
  p.clearance.enabled = false;
  p.post_impact->base_control->dumping = MomentumDumping{120, 30, 1};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  double fastest = 0;
  for (const WheelReport& wheel : r.wheels) fastest = std::max(fastest, wheel.largest_rate / wheel.rate_limit);
  EXPECT_NEAR(fastest, 1, 1e-9);
  EXPECT_LT(row(r, "angular_momentum_drift").value, 2e-12);  // measured 4e-13; 1.3e-11 with rounding in the inertia
  EXPECT_LT(row(r, "linear_momentum_drift").value, 2e-12);
}

// A control law ends when a joint reaches its range limit. The next phase begins with the stop's impact, and its energy
// balance includes that impact.
TEST(Actuators, StopAtPhaseStartIsInBalance) {
  CaptureProblem p = scenario("real-joints.yaml");
  p.clearance.enabled = false;
  p.post_impact->duration = 10;
  p.post_impact->joints = PostImpactSetup::Joints::keep_base_attitude;
  p.post_impact->keep_base_attitude.emplace();
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LawReport* law = r.law(LawReport::Law::base_keeping);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->joint, "wrist-pitch");
  ASSERT_FALSE(r.stop_impacts.empty());
  EXPECT_NEAR(r.stop_impacts[0].time, law->end, 1e-9);
  EXPECT_GT(r.stop_impacts[0].energy_lost, 1e-3);
  EXPECT_LT(row(r, "work_energy_residual").value, 1e-10);  // measured 4e-12
}

// The momentum used for target identification includes the rotors' spin.
TEST(Actuators, IdentificationIncludesRotorSpin) {
  CaptureProblem p = scenario("real-joints.yaml");
  p.clearance.enabled = false;
  p.control.emplace();
  p.control->timing.period = 0.05;
  p.post_impact->duration = 35;
  p.post_impact->joints = PostImpactSetup::Joints::computed_torque;
  p.post_impact->kp.assign(6, 0.25), p.post_impact->kd.assign(6, 1);
  p.post_impact->identify = IdentifySetup{};
  p.post_impact->identify->from = 1, p.post_impact->identify->duration = 30;
  p.post_impact->identify->sample_time = 0.1;
  p.post_impact->identify->excitation = ExcitationSetup{std::vector<double>(6, 0.2), 2};
  const CaptureResult r = simulate_capture(p);
  ASSERT_TRUE(r.identification) << r.failure;
  ASSERT_EQ(r.identification->rank, 10);
  for (int i = 0; i < 10; ++i) {
    const double size = i == 0 ? 250 : i < 4 ? 1 : 45;
    EXPECT_LT(std::abs(r.identification->parameters[i].error().value()), 1e-7 * size)
        << r.identification->parameters[i].name;
  }
}

// Friction stops all motion before the satellite is released. The servicer's remaining energy is rounding error, scaled
// by the earlier energy of its bodies.
TEST(Actuators, ServicerAtRestScaledByEarlierEnergy) {
  CaptureProblem p = scenario("real-joints.yaml");
  p.clearance.enabled = false;
  p.targets[0].V_WT = {{0, 0, 0}, {0, 0, 0}};
  p.approach->match.reset();
  p.approach->final_rates = {0.01, 0.02, -0.02, 0.01, 0.01, 0.02};
  for (BodyDescription& body : p.robot.bodies) {
    body.joint.friction = JointFriction{60, 0, 1e-3};
    body.joint.limits.stop.reset();
    body.joint.motor.reset();
    body.joint.rotor_axis.reset();
  }
  p.post_impact = PostImpactSetup{};
  p.post_impact->duration = 120;
  p.post_impact->releases.push_back({100, {}});
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_FALSE(r.releases.empty());
  const std::size_t last = r.series.time.size() - 1;
  EXPECT_GT(value_at(r, "system/kinetic_energy", 0, 0) + r.impact()->kinetic_energy_after, 1e-3);
  EXPECT_LT(value_at(r, "system/kinetic_energy", last, 0), 1e-20);
  EXPECT_LT(row(r, "energy_drift").value, 1e-10);  // measured 4e-12
}

}  // namespace actuators_test
}  // namespace grapnel::testing
