// Control moment gyros, wheels and thrusters in captures: arrays defined by few numbers, logs with commands per
// actuator, arrays near a singularity.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/actuator_arrays.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace {

using ::testing::HasSubstr;

const std::string kScenario = std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/control-moment-gyros.yaml";

const Series& series_of(const CaptureResult& result, const std::string& path) {
  for (const Series& one : result.series.series) {
    if (one.path == path) return one;
  }
  throw std::runtime_error(path);
}

void expect_passes(const CaptureResult& r) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  for (const LedgerEntry& e : r.ledger.entries) EXPECT_TRUE(e.pass()) << e.name << " " << e.value << " > " << e.bound;
}

class Log {
 public:
  explicit Log(const std::string& text) { std::ofstream(file_) << text; }
  ~Log() { std::filesystem::remove(file_); }
  // Overrides for a motion after the capture that the log drives, with a wheel and two thrusters added.
  std::vector<Override> overrides() const {
    return {{"robot.wheels", "[{name: w, axis: [0, 0, 1], inertia: 0.05, torque: 0.4}]"},
            {"robot.thrusters",
             "[{name: a, position: [0, 0.6, 0], direction: [1, 0, 0], force: 2, specific_impulse: 200, min_on_time: "
             "0.01}, {name: b, position: [0, -0.6, 0], direction: [1, 0, 0], force: 2, specific_impulse: 200}]"},
            {"approach.base_control.actuators", "gyros"},
            {"post_impact", "{duration: 4, joints: controller}"},
            {"control", "{period: 0.1, torques: " + file_.string() + "}"}};
  }

 private:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() / "grapnel_actuators.csv";
};
const std::string kHead = "time,shoulder-yaw,shoulder-pitch,elbow,wrist-roll,wrist-pitch,wrist-yaw";

std::string fault_of(const std::string& text, std::vector<Override> more = {}) {
  const Log log(text);
  std::vector<Override> overrides = log.overrides();
  overrides.insert(overrides.end(), more.begin(), more.end());
  try {
    load_scenario(kScenario, overrides);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

// Each row holds until the next: wheel torque, gimbal rate, thruster pulses in every period.
TEST(ActuatorLog, CommandsEachActuator) {
  SKIP_UNDER_SANITIZERS();
  const Log log(kHead +
                ",wheel.w,gyro.gyro-2,thruster.a,thruster.b\n0,0,0,0,0,0,0,0,0,0,0\n"
                "60.5,0,0,0,0,0,0,0.3,0.2,0.25,0\n62.5,0,0,0,0,0,0,-0.1,-0.1,0,1\n63.5,0,0,0,0,0,0,0,0,0,0\n");
  CaptureProblem problem = load_scenario(kScenario, log.overrides());
  ASSERT_TRUE(problem.control->log && problem.control->log->commands_actuators());
  EXPECT_FALSE(problem.control->base_torque);
  problem.output_interval = 0.05;
  const CaptureResult r = simulate_capture(problem);
  expect_passes(r);
  const Series &torque = series_of(r, "wheels/torque"), &rate = series_of(r, "gyros/rate"),
               &force = series_of(r, "thrusters/force");
  double most = 0;
  std::size_t checked = 0;
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    const double t = r.series.time[i];
    if (r.series.phases[r.series.phase[i]] != "post_impact" || std::abs(t / 0.5 - std::round(t / 0.5)) < 1e-3) continue;
    ++checked;
    const double commanded = t < 60.5 ? 0 : t < 62.5 ? 0.3 : t < 63.5 ? -0.1 : 0;
    EXPECT_NEAR(torque.data[i], commanded, 1e-15) << t;
    // The gimbal loop settles within several of its time constants of 0.05 s.
    const double since = t - (t < 60.5 ? 60 : t < 62.5 ? 60.5 : t < 63.5 ? 62.5 : 63.5);
    const double wanted = t < 60.5 ? 0 : t < 62.5 ? 0.2 : t < 63.5 ? -0.1 : 0;
    if (since > 0.4) {
      EXPECT_NEAR(rate.data[4 * i + 1], wanted, 2e-3) << t;
    }
    EXPECT_NEAR(rate.data[4 * i], 0, 1e-3) << t;
    most = std::max(most, force.data[2 * i + 1]);
  }
  EXPECT_GT(checked, 50u);
  EXPECT_EQ(most, 2);
  ASSERT_TRUE(r.thrusters);
  EXPECT_NEAR(r.thrusters->each[0].on_time, 0.25 * 2, 1e-9);  // a quarter of every period from 60.5 to 62.5 s
  EXPECT_EQ(r.thrusters->each[0].firings, 20);
  EXPECT_NEAR(r.thrusters->each[1].on_time, 1, 1e-9);
  EXPECT_EQ(r.thrusters->each[1].firings, 1);
  // The external impulse equals the impulse of the thrusters.
  const Series& impulse = series_of(r, "system/external_impulse");
  const std::size_t last = impulse.data.size() - 3;
  const double size = std::hypot(impulse.data[last], impulse.data[last + 1], impulse.data[last + 2]);
  std::printf("[ measured ] external impulse %.6g N s of %.6g\n", size, 2 * 1.5);
  EXPECT_NEAR(size, 3, 0.05);  // the base turns slightly during this time
}

TEST(ActuatorLog, RejectsMismatch) {
  const std::string zeros = "\n0,0,0,0,0,0,0,0\n60,0,0,0,0,0,0,";
  const auto expect = [&](const std::string& text, const std::vector<std::string>& parts,
                          const std::vector<Override>& more = {}) {
    const std::string fault = fault_of(text, more);
    for (const std::string& part : parts) EXPECT_THAT(fault, HasSubstr(part));
  };
  expect(kHead + ",wheel.v" + zeros + "0\n",
         {"grapnel_actuators.csv:1:73: error: unknown column 'wheel.v': the robot has no wheel 'v'"});
  expect(kHead + ",gyro.gyro-5" + zeros + "0\n", {"the robot has no gyro 'gyro-5'; did you mean 'gyro-"});
  expect(kHead + ",wheel.w" + zeros + "0.5\n",
         {"grapnel_actuators.csv:3:16: error: wheel.w is 0.5, beyond the wheel's largest torque, 0.4"});
  expect(kHead + ",gyro.gyro-1" + zeros + "-2\n",
         {":3:16: error: gyro.gyro-1 is -2, beyond the gyro's largest gimbal rate, 1"});
  expect(kHead + ",thruster.a" + zeros + "1.5\n",
         {":3:16: error: thruster.a is 1.5, must be from 0 to 1, the share of a period for which the valve is open"});
  expect(kHead + ",thruster.a" + zeros + "on\n", {":3:16: error: thruster.a must be a number [1]"});
  expect(kHead + ",thruster.a" + zeros + "0.05\n",
         {"control.torques opens thruster 'a' at 60 [s] for 0.005 s, but its valve is open for at least 0.01 s"});
  expect(kHead + ",wheel.w,base.x,base.y,base.z\n0,0,0,0,0,0,0,0,0,0,0\n60,0,0,0,0,0,0,0,0,0,0\n",
         {":1:1: error: the header has base.x"});
  expect(kHead + ",wheel.w" + zeros + "0\n",
         {"post_impact.base_control: control.torques commands each actuator of the base"},
         {{"post_impact.base_control", "{kp: 1, kd: 1, actuators: outside}"}});
}

TEST(ActuatorArrays, ArePyramidsOrOrthogonal) {
  GyroArraySetup gyros;
  gyros.each.inertia = 1;
  const std::vector<MomentGyroSetup> pyramid = gyros_of(gyros);
  ASSERT_EQ(pyramid.size(), 4u);
  Vector3d sum = Vector3d::zero();
  double capacity[3] = {0, 0, 0};
  for (const MomentGyroSetup& g : pyramid) {
    EXPECT_NEAR(norm(g.gimbal_axis), 1, 1e-15);
    EXPECT_NEAR(dot(g.gimbal_axis, g.spin_axis), 0, 1e-16);
    EXPECT_NEAR(g.gimbal_axis[2], std::sqrt(1.0 / 3), 1e-15);
    sum += g.spin_axis;
    for (int k = 0; k < 3; ++k) capacity[k] += g.gimbal_axis[k] * g.gimbal_axis[k];
  }
  EXPECT_LT(norm(sum), 1e-15);
  for (const double c : capacity) EXPECT_NEAR(c, 4.0 / 3, 1e-14);  // equal along all axes
  EXPECT_EQ(pyramid[3].name, "gyro-4");
  EXPECT_NEAR(pyramid[0].gimbal_axis[0], std::sqrt(2.0 / 3), 1e-15);  // the first is inclined towards x
  EXPECT_NEAR(pyramid[0].spin_axis[1], 1, 1e-15);

  WheelArraySetup wheels;
  wheels.layout = {ArrayConfiguration::pyramid, BaseAxis::x, 0.4, std::numbers::pi / 4};
  const std::vector<WheelSetup> about_x = wheels_of(wheels);
  EXPECT_NEAR(about_x[0].axis[0], std::cos(0.4), 1e-15);
  EXPECT_NEAR(about_x[0].axis[1], std::sin(0.4) * std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(about_x[0].axis[2], std::sin(0.4) * std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(about_x[1].axis[1], -std::sin(0.4) * std::sqrt(0.5), 1e-15);
  wheels.layout.configuration = ArrayConfiguration::orthogonal;
  const std::vector<WheelSetup> three = wheels_of(wheels);
  ASSERT_EQ(three.size(), 3u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(three[k].axis[k], 1);
}

// An array that starts near a singularity: summary and warning report it, and momentum is conserved.
TEST(GyroCapture, ReportsSingularArray) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem problem = load_scenario(
      kScenario,
      std::vector<Override>{{"initial.gimbal_angles", "[-90 deg, 0, 90 deg, 0]"}, {"post_impact.duration", "40"}});
  const CaptureResult r = simulate_capture(problem);
  expect_passes(r);
  ASSERT_TRUE(r.gyros);
  EXPECT_LT(r.gyros->least_singularity_measure, 1e-6);
  ASSERT_FALSE(r.gyros->hazards.empty());
  EXPECT_EQ(r.gyros->hazards[0].begin, 0);
  EXPECT_GT(r.gyros->hazards[0].duration(), 0.1);
  EXPECT_GT(r.gyros->largest_torque_lacking, 0.01);
  ASSERT_FALSE(r.warnings.empty());
  EXPECT_THAT(r.warnings.back(), HasSubstr("the array was near a singularity"));
  std::printf("[ measured ] near a singularity for %.4g s, torque lacking %.3g N m\n", r.gyros->hazards[0].duration(),
              r.gyros->largest_torque_lacking);
}

// The arms alone hold the base's attitude with idle gyros: the control law includes motors that hold the gimbal and
// rotor rates.
TEST(GyroCapture, ArmsControlBaseWithIdleGyros) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult r = simulate_capture(load_scenario(
      kScenario,
      std::vector<Override>{{"post_impact", "{duration: 20, joints: keep_base_attitude, kp: 300, kd: 300}"}}));
  expect_passes(r);
  const LawReport* law = r.law(LawReport::Law::base_keeping);
  ASSERT_TRUE(law);
  std::printf("[ measured ] base off by %.3g rad, %.3g rad/s\n", law->angle_after, law->angular_velocity_after);
  EXPECT_EQ(law->ended, LawEnd::running);
  EXPECT_LT(law->angle_after, 1e-6);  // measured 3.1e-7, from 2.5e-4
}

}  // namespace
}  // namespace grapnel
