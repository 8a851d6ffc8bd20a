/// Information of the on-board computer: sensors under sampled control, target estimates and replanning, identification
/// of the captured target and its use by controllers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "capture/capture_case.hpp"
#include "capture/loop_case.hpp"
#include "capture/recorded.hpp"
#include "grapnel/capture/identification_run.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/simulate/sensor_reader.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace sensors_test {

constexpr double kPeriod = 0.1, kApproach = 90;

// A servicer with wheels and a seven-joint arm captures a tumbling satellite of 1 t; all is sampled at 10 Hz.
CaptureProblem sampled(double after) {
  CaptureProblem p = scenario("bias-momentum.yaml");
  p.control.emplace();
  p.control->timing.period = kPeriod;
  p.post_impact->duration = after;
  p.clearance.enabled = false;
  // Exciting a satellite of 1 t exceeds the arm's effort limits; these tests do not concern saturation.
  for (BodyDescription& body : p.robot.bodies) body.joint.limits.effort = std::numeric_limits<double>::infinity();
  return p;
}

SensorSetup noisy() {
  SensorSetup s;
  s.seed = 7;
  s.joints.emplace();
  s.joints->noise = 2e-5, s.joints->quantum = 1e-4, s.joints->bias.assign(7, 3e-4);
  s.joints->rate = JointSensors::Rate::sensor, s.joints->rate_noise = 1e-4;
  s.gyro.emplace();
  s.gyro->noise = 1e-4, s.gyro->bias = {1e-4, -2e-4, 3e-4};
  s.attitude.emplace();
  s.attitude->noise = 1e-4, s.attitude->sample_time = 3 * kPeriod;
  s.wheels.emplace();
  s.wheels->noise = 0.1, s.wheels->quantum = 0.5;
  s.wrists.push_back({.end_effector = "gripper", .force_noise = 0.1, .torque_noise = 0.1});
  return s;
}

// Moments of 40 000 numbers of one channel, and correlations with the next time, channel, sensor and seed.
TEST(SensorNoise, WhiteNormalAndIndependent) {
  constexpr int kCount = 40000;
  const double expected = 1 / std::sqrt(double{kCount});
  double sum = 0, squares = 0, fourths = 0, next = 0, channel = 0, sensor = 0, seed = 0;
  for (int i = 0; i < kCount; ++i) {
    const auto n = static_cast<std::uint64_t>(i);
    const double x = normal_number(1, 2, 3, n);
    sum += x, squares += x * x, fourths += x * x * x * x;
    next += x * normal_number(1, 2, 3, n + 1), channel += x * normal_number(1, 2, 4, n);
    sensor += x * normal_number(1, 3, 3, n), seed += x * normal_number(2, 2, 3, n);
  }
  EXPECT_LT(std::abs(sum / kCount), 4 * expected);
  EXPECT_LT(std::abs(squares / kCount - 1), 4 * std::sqrt(2.0) * expected);
  EXPECT_LT(std::abs(fourths / kCount - 3), 4 * std::sqrt(96.0) * expected);
  for (const double correlation : {next, channel, sensor, seed})
    EXPECT_LT(std::abs(correlation / kCount), 4 * expected);
  EXPECT_EQ(normal_number(1, 2, 3, 5), normal_number(1, 2, 3, 5));
}

TEST(Sensors, QuantumSampleTimeAndBias) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = sampled(5);
  p.sensors.emplace();
  p.sensors->joints.emplace();
  JointSensors& joints = *p.sensors->joints;
  joints.counts_per_turn = 4096, joints.sample_time = 2 * kPeriod, joints.bias = {0.01, -0.02, 0, 0, 0, 0, 0.03};
  p.sensors->gyro.emplace();
  p.sensors->gyro->bias = {1e-3, 2e-3, -3e-3};
  p.output_interval = kPeriod;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const double quantum = 2 * M_PI / 4096;
  int changes = 0;
  for (std::size_t i = 1; i + 1 < r.series.time.size() && r.series.time[i] < kApproach - 0.01; ++i) {
    const long tick = std::lround(r.series.time[i] / kPeriod);
    for (int j = 0; j < 7; ++j) {
      const double read = value_at(r, "joints/measured_position", i, j);
      EXPECT_NEAR(read / quantum, std::round(read / quantum), 1e-9);
      if (tick % 2 == 0) {
        const double truth = value_at(r, "joints/position", i, j);
        EXPECT_LE(std::abs(read - truth - joints.bias[j]), 0.5 * quantum + 1e-9) << r.series.time[i];
        changes += read != value_at(r, "joints/measured_position", i - 1, j);
        // The rate is the difference quotient of the readings.
        if (tick >= 4) {
          EXPECT_NEAR(value_at(r, "joints/measured_velocity", i, j),
                      (read - value_at(r, "joints/measured_position", i - 2, j)) / (2 * kPeriod), 1e-12);
        }
      } else {
        EXPECT_EQ(read, value_at(r, "joints/measured_position", i - 1, j));
      }
    }
    const Rotationd R = pose_at(r, "base", i).R;
    const Vector3d w = transposed_times(R, vector_at(r, "base/angular_velocity", i));
    EXPECT_LT(norm(vector_at(r, "base/measured_angular_velocity", i) - w - p.sensors->gyro->bias), 1e-12);
  }
  EXPECT_GT(changes, 100);
}

TEST(Sensors, NoiseDeviationMomentumAndReproducibility) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = sampled(20);
  p.approach->tracking.mode = JointControl::computed_torque;
  p.approach->tracking.kp.assign(7, 0.25), p.approach->tracking.kd.assign(7, 1);
  p.contact.largest_gap = 1;
  p.robot.end_effectors[0].envelope.reset();
  p.sensors = noisy();
  const CaptureResult r = simulate_capture(p), again = simulate_capture(p, {}, CaptureDetail::columns);
  expect_passes(r);
  EXPECT_EQ(norm(r.post_impact_end->base.position - again.post_impact_end->base.position), 0);
  EXPECT_GT(norm(vector_at(r, "system/angular_momentum", 0)), 1);
  std::map<std::string, SensorReport> by_name;
  for (const SensorReport& s : r.sensors) by_name[s.sensor] = s;
  const SensorReport& rate = by_name.at("joint rate");
  EXPECT_NEAR(rate.rms_error, 1e-4, 4e-4 / std::sqrt(2.0 * static_cast<double>(rate.readings)));
  EXPECT_LT(std::abs(rate.mean_error), 4e-4 / std::sqrt(static_cast<double>(rate.readings)));
  const SensorReport& position = by_name.at("joint position");
  EXPECT_NEAR(position.mean_error, 3e-4,
              4 * std::sqrt(4e-10 + 1e-8 / 12) / std::sqrt(static_cast<double>(position.readings)));
  EXPECT_EQ(position.readings, 7 * 1100);
  EXPECT_EQ(by_name.at("attitude").readings, 3 * 367);
  EXPECT_NEAR(by_name.at("attitude").rms_error, 1e-4, 4e-4 / std::sqrt(2.0 * 1101));
  EXPECT_NEAR(by_name.at("force gripper").rms_error, 0.1, 0.4 / std::sqrt(2.0 * 3300));
  EXPECT_NEAR(by_name.at("wheel rate").rms_error, std::sqrt(0.01 + 0.25 / 12), 0.02);
  // The wrist sensor of a closed grasp measures the recorded grasp force, which is in W.
  const std::size_t last = r.series.time.size() - 1;
  EXPECT_NEAR(norm(vector_at(r, "end_effectors/gripper/measured_force", last)),
              norm(vector_at(r, "grasps/gripper/force", last)), 1.5);
  // Without sensors the motion differs.
  p.sensors.reset();
  EXPECT_GT(norm(simulate_capture(p).post_impact_end->base.position - r.post_impact_end->base.position), 1e-6);
}

// Without noise the error of a reading is its bias, in the sensor's axes. An angle random walk gives a rate error that
// is inversely proportional to the root of the sample time.
TEST(Sensors, BiasesAndRandomWalks) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = sampled(5);
  p.sensors.emplace();
  p.sensors->joints.emplace();
  p.sensors->joints->rate = JointSensors::Rate::sensor, p.sensors->joints->rate_bias = 2e-4;
  p.sensors->gyro.emplace();
  p.sensors->gyro->angle_random_walk = 1e-5;
  p.sensors->attitude.emplace();
  p.sensors->attitude->bias = {1e-3, 0, 0};
  p.sensors->wheels.emplace();
  p.sensors->wheels->bias = 0.5;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_GT(rotation_angle(pose_at(r, "base", r.series.time.size() - 1).R), 0.01);  // W's axes are not the base's
  std::map<std::string, SensorReport> by_name;
  for (const SensorReport& s : r.sensors) by_name[s.sensor] = s;
  EXPECT_NEAR(by_name.at("joint rate").mean_error, 2e-4, 1e-15);
  EXPECT_NEAR(by_name.at("joint rate").largest_error, 2e-4, 1e-15);
  EXPECT_NEAR(by_name.at("wheel rate").mean_error, 0.5, 1e-12);
  EXPECT_NEAR(by_name.at("attitude").mean_error, 1e-3 / 3, 1e-14);
  EXPECT_NEAR(by_name.at("attitude").largest_error, 1e-3, 1e-14);
  const SensorReport& gyro = by_name.at("gyro");
  const double deviation = 1e-5 / std::sqrt(kPeriod);
  EXPECT_NEAR(gyro.rms_error, deviation, 4 * deviation / std::sqrt(2.0 * static_cast<double>(gyro.readings)));
}

// Controllers use the readings of attitude sensor and tachometers: the final base attitude and wheel speeds differ from
// the exact ones by the biases.
TEST(Sensors, LawsUseReadings) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = sampled(60);
  p.post_impact->base_control->wheel_speed_rate = 0.1;
  // The pyramid's null space is (1, -1, 1, -1). Reversing two wheels makes it (1, 1, 1, 1), parallel to the bias.
  ASSERT_EQ(p.robot.wheels.size(), 4U);
  for (const std::size_t w : {1, 3}) p.robot.wheels[w].axis = -p.robot.wheels[w].axis, p.wheel_rate[w] *= -1;
  const CaptureResult exact = simulate_capture(p);
  p.sensors.emplace();
  p.sensors->attitude.emplace();
  p.sensors->attitude->bias = {0.002, 0, 0};
  p.sensors->wheels.emplace();
  p.sensors->wheels->bias = 5;
  const CaptureResult read = simulate_capture(p);
  expect_passes(read);
  const std::size_t a = exact.series.time.size() - 1, b = read.series.time.size() - 1;
  EXPECT_GT(rotation_angle(transpose(pose_at(exact, "base", a).R) * pose_at(read, "base", b).R), 0.0005);
  double apart = 0;
  for (std::size_t w = 0; w < 4; ++w) apart += (read.wheels[w].rate_after - exact.wheels[w].rate_after) / 4;
  EXPECT_NEAR(apart, -5, 0.1);
}

// Computed torque takes inertias at the measured coordinates, whether velocities of roots are recovered from momenta or
// integrated: the first leaves joint transforms of the true coordinates in the workspace.
TEST(Sensors, ComputedTorqueTakesInertiasAtReadings) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = sampled(1);
  p.post_impact.reset();
  p.robot.wheels.clear(), p.wheel_rate.clear();
  p.approach->base_control.reset();
  p.approach->duration = 20;
  p.robot.end_effectors[0].envelope->position = 2;
  TrackingSetup& tracking = p.approach->tracking;
  tracking.mode = JointControl::computed_torque;
  tracking.kp.assign(7, 4), tracking.kd.assign(7, 4);
  p.sensors.emplace();
  p.sensors->joints.emplace();
  p.sensors->joints->bias.assign(7, 0.3);
  const CaptureResult recovered = simulate_capture(p);
  p.integration.root_velocity = IntegrationSetup::RootVelocity::integrated;
  const CaptureResult integrated = simulate_capture(p);
  const std::size_t last = recovered.series.time.size() - 1;
  ASSERT_EQ(integrated.series.time.size() - 1, last);
  const Posed a = pose_at(recovered, "base", last), b = pose_at(integrated, "base", last);
  EXPECT_LT(norm(a.p - b.p), 1e-7);
  EXPECT_LT(rotation_angle(transpose(a.R) * b.R), 1e-7);
}

// --- Estimates ---

CaptureProblem estimated(const TargetEstimate& error) {
  CaptureProblem p = scenario("bias-momentum.yaml");
  p.post_impact.reset();
  p.robot.wheels.clear(), p.wheel_rate.clear();
  p.approach->base_control.reset();
  p.approach->duration = 40;
  p.approach->plan->starts = 4;
  p.robot.end_effectors[0].envelope->position = 0.2;
  p.clearance.enabled = false;
  p.targets[0].estimate = error;
  return p;
}

TEST(Navigation, ExactEstimateYieldsIdenticalPlan) {
  CaptureProblem exact = estimated({}), truth = exact;
  truth.targets[0].estimate.reset();
  const CaptureResult a = simulate_capture(exact), b = simulate_capture(truth);
  ASSERT_EQ(a.navigation.size(), 1u);
  EXPECT_EQ(a.navigation[0].estimates[0].position_error, 0);
  EXPECT_TRUE(b.navigation.empty());
  EXPECT_EQ(a.plan->final_position, b.plan->final_position);
  EXPECT_EQ(norm(a.approach_end->base.position - b.approach_end->base.position), 0);
}

TEST(Navigation, EstimateErrorIsGapAndReplanningRemovesIt) {
  TargetEstimate error;
  error.position_error = {0.03, -0.04, 0.12};
  CaptureProblem p = estimated(error);
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_NEAR(r.navigation[0].estimates[0].position_error, 0.13, 1e-12);
  EXPECT_NEAR(r.grasps[0].distance, 0.13, 1e-8);

  p.approach->replan = ReplanSetup{8};
  const CaptureResult replanned = simulate_capture(p);
  ASSERT_EQ(replanned.status, CaptureStatus::completed) << replanned.failure;
  ASSERT_EQ(replanned.navigation.size(), 5u);  // at 0, 8, 16, 24, 32
  for (const NavigationReport& n : replanned.navigation) EXPECT_TRUE(n.found) << n.time << ": " << n.failure;
  EXPECT_LT(replanned.grasps[0].distance, 1e-7);
  expect_passes(replanned);
  // The joint trajectory is continuous in position and rate.
  for (std::size_t i = 1; i < replanned.series.time.size(); ++i) {
    if (replanned.series.time[i] != replanned.series.time[i - 1]) continue;
    for (int j = 0; j < 7 && replanned.series.time[i] < 39; ++j) {
      EXPECT_NEAR(value_at(replanned, "joints/position", i, j), value_at(replanned, "joints/position", i - 1, j), 1e-9);
      EXPECT_NEAR(value_at(replanned, "joints/velocity", i, j), value_at(replanned, "joints/velocity", i - 1, j), 1e-9);
    }
  }

  // With a noisy, delayed sensor the gap equals the error of the last estimate.
  p.control.emplace();
  p.control->timing.period = kPeriod;
  p.sensors.emplace();
  p.sensors->relative_poses.push_back({.target = "satellite", .position_noise = 0.01, .delay = 0.5});
  const CaptureResult measured = simulate_capture(p);
  ASSERT_EQ(measured.status, CaptureStatus::completed) << measured.failure;
  const double last = measured.navigation.back().estimates[0].position_error;
  EXPECT_GT(last, 1e-4);
  EXPECT_LT(last, 0.06);
  EXPECT_NEAR(measured.grasps[0].distance, last, 1e-6);
}

TEST(Navigation, ReplansUntilLimit) {
  CaptureProblem p = estimated({});
  p.approach->replan = ReplanSetup{5};
  p.approach->replan->until = 12;
  const CaptureResult r = simulate_capture(p);
  std::vector<double> times;
  for (const NavigationReport& plan : r.navigation) times.push_back(plan.time);
  ASSERT_EQ(times.size(), 3U) << r.failure;
  EXPECT_NEAR(times[1], 5, 1e-9);
  EXPECT_NEAR(times[2], 10, 1e-9);
}

// --- Identification ---

CaptureProblem identified(double after) {
  CaptureProblem p = sampled(after);
  p.post_impact->base_control.reset();
  p.post_impact->identify.emplace();
  IdentifySetup& identify = *p.post_impact->identify;
  identify.from = 2, identify.duration = 40, identify.sample_time = 2 * kPeriod;
  identify.excitation = ExcitationSetup{std::vector<double>(7, 0.25), 2};
  return p;
}

TEST(IdentificationInARun, ExactWithoutNoise) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult r = simulate_capture(identified(45));
  expect_passes(r);
  ASSERT_TRUE(r.identification);
  const IdentificationReport& found = *r.identification;
  EXPECT_EQ(found.ended, IdentificationEnd::done);
  EXPECT_EQ(found.samples, 200);
  EXPECT_EQ(found.rank, 10);
  EXPECT_EQ(found.mass, "determined");
  ASSERT_EQ(found.parameters.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    const double size = i == 0 ? 1000 : i < 4 ? 1 : 450;
    EXPECT_LT(std::abs(found.parameters[i].error().value()), 1e-6 * size) << found.parameters[i].name;
  }
  EXPECT_NEAR(found.used_from.value(), kApproach + 42, 1e-9);
}

TEST(IdentificationInARun, WithinThreeSigmaWithNoise) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = identified(45);
  p.sensors.emplace();
  p.sensors->seed = 3;
  p.sensors->gyro.emplace();
  p.sensors->gyro->noise = 1e-6;
  p.sensors->joints.emplace();
  p.sensors->joints->rate = JointSensors::Rate::sensor, p.sensors->joints->rate_noise = 1e-6;
  const CaptureResult r = simulate_capture(p);
  ASSERT_TRUE(r.identification) << r.failure;
  EXPECT_EQ(r.identification->rank, 10);
  for (const IdentifiedParameter& parameter : r.identification->parameters) {
    ASSERT_TRUE(parameter.error() && parameter.deviation) << parameter.name;
    EXPECT_LT(std::abs(*parameter.error()), 3 * *parameter.deviation) << parameter.name;
    EXPECT_GT(std::abs(*parameter.error()), 1e-4 * *parameter.deviation) << parameter.name;
  }
  EXPECT_NEAR(r.identification->residual, 1, 0.2);
}

TEST(IdentificationInARun, ReportsUnobservableParameters) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = identified(45);
  p.post_impact->identify->excitation.reset();
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  p.post_impact->assumed = AssumedTarget{.target = {}, .mass = 700, .com = {}, .inertia = {}};
  const CaptureResult r = simulate_capture(p);
  ASSERT_TRUE(r.identification) << r.failure;
  EXPECT_LT(r.identification->rank, 10);
  EXPECT_FALSE(r.identification->unseen.empty());
  EXPECT_FALSE(r.identification->used_from);  // controllers continue with the assumed values
}

TEST(IdentificationInARun, WeightsFromNoiseAndRounding) {
  CaptureProblem p = sampled(5);
  p.sensors.emplace();
  p.sensors->gyro.emplace();
  p.sensors->gyro->noise = 3e-5, p.sensors->gyro->quantum = 1e-4;
  p.sensors->joints.emplace();
  p.sensors->joints->noise = 2e-5, p.sensors->joints->quantum = 1e-4;
  p.sensors->joints->rate = JointSensors::Rate::difference, p.sensors->joints->sample_time = 2 * kPeriod;
  const RateNoise noise = rate_noise_of(p);
  EXPECT_NEAR(noise.angular_velocity, std::sqrt(9e-10 + 1e-8 / 12), 1e-18);
  EXPECT_NEAR(noise.joint_rate, std::sqrt(2 * (4e-10 + 1e-8 / 12)) / (2 * kPeriod), 1e-18);
}

TEST(IdentificationInARun, EndsAtRelease) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = identified(45);
  p.post_impact->releases.push_back({20, {}});
  const CaptureResult r = simulate_capture(p);
  ASSERT_TRUE(r.identification) << r.failure;
  EXPECT_EQ(r.identification->ended, IdentificationEnd::released);
  EXPECT_NEAR(r.identification->end, kApproach + 20, 1e-9);
  EXPECT_FALSE(r.identification->used_from);
}

// Largest deviation of the joints from their references, from the time `from` on.
double tracking_error(const CaptureResult& r, double from) {
  double largest = 0;
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    for (int j = 0; j < 7 && r.series.time[i] >= from; ++j)
      largest = std::max(
          largest, std::abs(value_at(r, "joints/position", i, j) - value_at(r, "joints/reference_position", i, j)));
  }
  return largest;
}

TEST(AssumedTarget, ComputedTorqueErrorWithWrongAssumption) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = identified(90);
  // A hold of 0.1 s causes larger torque errors than a wrong mass, since the arm's self-motion has little inertia.
  p.control->timing.period = 0.02;
  p.post_impact->identify->excitation->amplitude.assign(7, 0.1);
  p.post_impact->move = PostureMove{{0.3, -0.5, 0.4, 1.5, -0.3, 0.2, 0.3}, 48, 30, JointProfile::quintic};
  p.post_impact->assumed =
      AssumedTarget{.target = {}, .mass = 500, .com = {}, .inertia = Symmetric3d{200, 200, 200, 0, 0, 0}};
  const double from = kApproach + 60;  // after the effect of the excitation has decayed
  p.post_impact->model = LawModel::assumed;
  const CaptureResult wrong = simulate_capture(p);
  p.post_impact->model = LawModel::estimated;
  const CaptureResult adapted = simulate_capture(p);
  p.post_impact->model = LawModel::truth;
  const CaptureResult truth = simulate_capture(p);
  expect_passes(wrong);
  expect_passes(adapted);
  const double guess = tracking_error(wrong, from), estimate = tracking_error(adapted, from),
               exact = tracking_error(truth, from);
  RecordProperty("wrong", std::to_string(guess));
  std::printf("tracking errors: assumed %.3g, estimated %.3g, true %.3g rad\n", guess, estimate, exact);
  EXPECT_GT(guess, 2 * exact);                 // measured 4.98e-3 and 2.11e-3, the latter from the hold
  EXPECT_NEAR(estimate, exact, 0.01 * guess);  // measured 2.10e-3
}

// --- Faults ---

std::string faults_of(const CaptureProblem& problem) {
  std::string text;
  for (const ProblemFault& fault : problem_conflicts(problem)) text += fault.path + ": " + fault.message + "\n";
  return text;
}

TEST(SensorFaults, AreNamed) {
  using ::testing::HasSubstr;
  CaptureProblem p = sampled(20);
  EXPECT_EQ(faults_of(p), "");
  p.sensors = noisy();
  EXPECT_EQ(faults_of(p), "");
  p.sensors->gyro->sample_time = 0.25;
  EXPECT_THAT(faults_of(p),
              HasSubstr("sensors.gyro.sample_time is 0.25 [s], must be a multiple of control.period, 0.1"));
  p.sensors->wrists.push_back(p.sensors->wrists[0]);
  EXPECT_THAT(faults_of(p), HasSubstr("sensors.force_torque[1] is a second sensor of end-effector \"gripper\""));
  p.control.reset();
  EXPECT_THAT(faults_of(p), HasSubstr("control: {period: ...} is missing"));
  p = identified(30);
  EXPECT_THAT(faults_of(p), HasSubstr("post_impact.identify ends after 42 [s], must end within post_impact's 30"));
  p = identified(60);
  p.post_impact->joints = PostImpactSetup::Joints::free;
  EXPECT_THAT(faults_of(p), HasSubstr("post_impact.identify.excitation: joints that are free follow no reference"));
  p = sampled(20);
  p.post_impact->model = LawModel::estimated;
  EXPECT_THAT(faults_of(p), HasSubstr("post_impact.model is estimated, which needs post_impact.identify"));
  p = estimated({});
  p.approach->replan = ReplanSetup{50};
  p.approach->profile = JointProfile::quartic;
  EXPECT_THAT(faults_of(p), HasSubstr("approach.replan.every is 50 [s], must be less than 40"));
  EXPECT_THAT(faults_of(p), HasSubstr("approach.replan: the quartic profile starts from rest"));
}

}  // namespace sensors_test
}  // namespace grapnel::testing
