// What a run records: the grid of samples, references of held joints, actuators at instants with a jump, and everything
// that momentum needs; set points that come through sensors; joint limits beside stops.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/capture/simulate_capture.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace outputs_test {

using ::testing::IsEmpty;
using ::testing::SizeIs;

// An arm with two joints takes hold of a satellite at t = 0, with gaps.
constexpr const char* kRobot = R"(
name: outputs
robot:
  base: {mass: 300, com: [0.02, -0.03, 0.01], inertia: [60, 70, 80, 2, -3, 1]}
  links:
    - {name: upper, parent: base, mass: 10, com: [0.4, 0, 0], inertia: [0.1, 0.9, 0.9],
       joint: {name: shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0.1]}}}
    - {name: fore, parent: upper, mass: 8, com: [0.3, 0.02, 0], inertia: [0.1, 0.6, 0.6],
       joint: {name: elbow, type: revolute, axis: [0, 1, 0], origin: {position: [0.9, 0, 0]}}}
)";
constexpr const char* kEffector = "  end_effectors: [{name: tip, link: fore, position: [0.8, 0, 0]}]\n";
constexpr const char* kMoving = R"(
initial:
  base: {velocity: [0.01, 0, 0.02], angular_velocity: [0.02, -0.03, 0.05]}
  joints: [0.3, -0.4]
  joint_rates: [0.05, 0.1]
targets:
  - name: ball
    mass: 120
    com: [0.1, 0, 0.05]
    inertia: [20, 25, 30]
    state: {position: [2.4, 0.5, 0.3], velocity: [-0.02, 0.01, 0], angular_velocity: [0.1, -0.2, 0.15]}
    grasp_points: [{name: grip, position: [-0.3, 0, 0]}]
)";
constexpr const char* kGrasp = R"(
grasps: [{end_effector: tip, target: ball, point: grip}]
contact: {largest_gap: any}
impact: {}
)";
constexpr const char* kGyros =
    "  gyro_array: {configuration: pyramid, inertia: 0.025, spin_rate: 600 rad/s, gimbal_inertia: 0.03}\n";
constexpr const char* kWheels = "  wheel_array: {configuration: pyramid, inertia: 0.03}\n";

std::string capture_text(const std::string& actuators, const std::string& rest) {
  return std::string(kRobot) + kEffector + actuators + kMoving + kGrasp + rest;
}

CaptureResult simulate(const std::string& text, double interval = 0.1) {
  const test::TemporaryFolder folder;
  CaptureProblem problem = load_scenario(folder.write("scenario.yaml", text));
  problem.output_interval = interval;
  CaptureResult result = simulate_capture(problem);
  EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
  for (const LedgerEntry& entry : result.ledger.entries) {
    if (entry.kind != LedgerEntry::Kind::conservation) continue;
    EXPECT_TRUE(entry.pass()) << entry.name << " " << entry.value;
  }
  return result;
}

const Series& series_of(const CaptureResult& result, const std::string& path) {
  for (const Series& one : result.series.series) {
    if (one.path == path) return one;
  }
  throw std::runtime_error("no series " + path);
}
double number(const CaptureResult& result, const std::string& path, std::size_t sample, std::size_t component = 0) {
  const Series& series = series_of(result, path);
  return series.data[sample * series.components.size() + component];
}
Vector3d vector(const CaptureResult& result, const std::string& path, std::size_t sample) {
  return {number(result, path, sample, 0), number(result, path, sample, 1), number(result, path, sample, 2)};
}
Rotationd rotation(const CaptureResult& result, const std::string& path, std::size_t sample) {
  return rotation_matrix(Quaterniond{number(result, path, sample, 0), number(result, path, sample, 1),
                                     number(result, path, sample, 2), number(result, path, sample, 3)});
}
std::vector<std::size_t> samples_of(const CaptureResult& result, const std::string& phase) {
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < result.series.time.size(); ++i) {
    if (result.series.phases[static_cast<std::size_t>(result.series.phase[i])] == phase) samples.push_back(i);
  }
  return samples;
}

// --- Actuators at an impact ---

// In an impact no motor has an impulse: rotors change their rates relative to their gimbals.
TEST(Outputs, GyroMomentumFromRotorRates) {
  const CaptureResult r = simulate(capture_text(kGyros, "post_impact: {duration: 0.5}\n"));
  const double skew = std::acos(1 / std::sqrt(3.0));
  const std::vector<std::size_t> contact = samples_of(r, "contact");
  ASSERT_THAT(contact, SizeIs(2));
  double jump = 0;
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    Vector3d momentum = Vector3d::zero();
    for (std::size_t g = 0; g < 4; ++g) {
      const double a = 0.5 * std::acos(-1.0) * static_cast<double>(g), angle = number(r, "gyros/angle", i, g);
      const Vector3d gimbal{std::sin(skew) * std::cos(a), std::sin(skew) * std::sin(a), std::cos(skew)};
      const Vector3d spin{-std::sin(a), std::cos(a), 0};
      const double rate = number(r, "gyros/rotor_rate", i, g);
      momentum += 0.025 * rate * (std::cos(angle) * spin + std::sin(angle) * cross(gimbal, spin));
      if (i == contact[1]) jump = std::max(jump, std::abs(rate - 600));
    }
    EXPECT_LT(norm(vector(r, "gyros/momentum", i) - momentum), 1e-11) << r.series.time[i];  // measured 3e-14
  }
  EXPECT_GT(jump, 1e-3);  // measured 0.04
}

// --- The grid ---

TEST(Outputs, SamplesStayOnGridAfterEvent) {
  const CaptureResult r = simulate(capture_text("", "post_impact: {duration: 1, release: [{after: 0.33}]}\n"), 0.1);
  const std::vector<std::size_t> before = samples_of(r, "post_impact"), after = samples_of(r, "post_impact_2");
  ASSERT_THAT(before, SizeIs(5));
  ASSERT_THAT(after, SizeIs(8));
  EXPECT_EQ(r.series.time[before.back()], 0.33);
  EXPECT_EQ(r.series.time[after.front()], 0.33);
  for (std::size_t k = 1; k < 8; ++k)
    EXPECT_EQ(r.series.time[after[k]], k == 7 ? 1.0 : static_cast<double>(k + 3) * 0.1);
}

// --- References ---

TEST(Outputs, HeldJointReferenceIsSetPoint) {
  const std::string gains = ", kp: 20, kd: 10";
  for (const std::string& law :
       {std::string("pd") + gains, std::string("computed_torque") + gains, std::string("braked")}) {
    const CaptureResult r = simulate(capture_text("", "post_impact: {duration: 0.4, joints: " + law + "}\n"));
    for (std::size_t i : samples_of(r, "post_impact")) {
      EXPECT_EQ(number(r, "joints/reference_position", i, 0), 0.3) << law;
      EXPECT_EQ(number(r, "joints/reference_position", i, 1), -0.4) << law;
      EXPECT_EQ(number(r, "joints/reference_velocity", i, 1), 0) << law;
    }
  }
  const CaptureResult r = simulate(capture_text("", "post_impact: {duration: 0.4}\n"));
  for (std::size_t i : samples_of(r, "post_impact")) EXPECT_TRUE(std::isnan(number(r, "joints/reference_position", i)));
}

// --- Momentum from what is recorded ---

struct Momenta {
  double mass = 0;
  Vector3d moment_of_mass = Vector3d::zero();
  Vector3d linear = Vector3d::zero(), angular = Vector3d::zero();  // about the world's origin
};

void add_body(const CaptureResult& r, const SceneBody& body, std::size_t i, Momenta& sum) {
  const Rotationd R = rotation(r, body.series + "/quaternion_wxyz", i);
  const Vector3d w = vector(r, body.series + "/angular_velocity", i);
  const Vector3d arm = R * body.com, p = vector(r, body.series + "/position", i) + arm;
  const Vector3d v = vector(r, body.series + "/velocity", i) + cross(w, arm);
  sum.mass += body.mass;
  sum.moment_of_mass += body.mass * p;
  sum.linear += body.mass * v;
  sum.angular += body.mass * cross(p, v) + rotate(R, body.inertia) * w;
}

TEST(Outputs, MomentumFollowsFromTheTimeSeriesAndTheScene) {
  const std::string panel = R"(
    - {name: panel, parent: base, mass: 20, com: [0, 0.8, 0], inertia: [4, 1, 5],
       joint: {name: hinge, type: revolute, axis: [1, 0, 0], origin: {position: [0, 0.5, 0]}, spring: {stiffness: 40}}}
)";
  const std::string wing =
      "    panels: [{name: wing, mass: 8, com: [0, 0.6, 0], inertia: [1, 0.3, 1.2], hinge_axis: [1, 0, 0], hinge: "
      "{stiffness: 20}}]\n";
  const CaptureResult r =
      simulate(std::string(kRobot) + panel + kEffector + kWheels + kGyros + kMoving + wing + kGrasp +
               "post_impact: {duration: 1, joints: pd, kp: 20, kd: 10, base_control: {actuators: "
               "gyros, kp: 20, kd: 50}}\noutput: {links: true}\n");
  double turned = 0;
  for (std::size_t i = 0; i < r.series.time.size(); ++i) {
    Momenta robot, target;
    for (const SceneBody& body : r.scene.bodies)
      add_body(r, body, i, body.kind == "base" || body.kind == "link" ? robot : target);
    robot.angular += vector(r, "base/internal_angular_momentum", i);
    const Vector3d com = (1 / (robot.mass + target.mass)) * (robot.moment_of_mass + target.moment_of_mass);
    for (const auto& [group, sum] : {std::pair{std::string("robot"), robot}, {std::string("targets/ball"), target}}) {
      const Vector3d about_com = sum.angular - cross(com, sum.linear);
      EXPECT_LT(norm(vector(r, group + "/linear_momentum", i) - sum.linear), 1e-12) << group;  // measured 4e-15
      EXPECT_LT(norm(vector(r, group + "/angular_momentum", i) - about_com), 1e-11) << group;  // measured 2e-14
    }
    for (std::size_t g = 0; g < 4; ++g) turned = std::max(turned, std::abs(number(r, "gyros/angle", i, g)));
  }
  EXPECT_GT(turned, 0.01);
  EXPECT_GT(norm(vector(r, "targets/ball/angular_momentum", 0)), 1);
}

// --- Set points through sensors ---

constexpr const char* kAtRest = "initial: {joints: [0.3, -0.4]}";
constexpr const char* kQuietTarget = R"(
targets:
  - {name: ball, mass: 120, inertia: [20, 25, 30], state: {position: [2.4, 0.5, 0.3]}, grasp_points: [{name: grip}]}
)";

std::string hold_text(const std::string& post, const std::string& sensors, const std::string& more = "") {
  return std::string(kRobot) + kEffector + kAtRest + kQuietTarget + kGrasp + "post_impact: {duration: 2, " + post +
         "}\ncontrol: {period: 0.05}\nsensors: " + sensors + "\n" + more;
}

double largest_motion(const CaptureResult& r) {
  double largest = 0;
  for (std::size_t i : samples_of(r, "post_impact")) {
    for (std::size_t j = 0; j < 2; ++j)
      largest = std::max(largest, std::abs(number(r, "joints/position", i, j) - number(r, "joints/position", 0, j)));
    const Rotationd R = rotation(r, "base/quaternion_wxyz", i);
    largest = std::max(largest, rotation_angle(R));
  }
  return largest;
}

// Everything is at rest, and so it stays, whatever bias encoders and star trackers have.
TEST(Outputs, SetPointOfHoldFromBiasedReadings) {
  const std::string joints = "{joints: {bias: 0.01, quantum: 1e-3}}",
                    all = "{joints: {bias: 0.01}, attitude: {bias: [0.02, -0.01, 0.03]}}";
  const std::string pd = "joints: pd, kp: 30, kd: 8", base = ", base_control: {kp: 20, kd: 50}";
  for (const std::string& text :
       {hold_text(pd, joints), hold_text(pd + base, all), hold_text("joints: computed_torque, kp: 4, kd: 4", joints),
        hold_text("joints: keep_base_attitude, kp: 4, kd: 4", all)}) {
    const CaptureResult r = simulate(text);
    EXPECT_LT(largest_motion(r), 1e-9) << text;  // measured 1e-16
  }
  const CaptureResult r = simulate(hold_text(pd, joints));
  EXPECT_NEAR(number(r, "joints/reference_position", samples_of(r, "post_impact")[0], 0), 0.31, 1e-12);
}

// Between two ticks the last reading counts.
TEST(Outputs, SetPointBetweenSamplesIsLastReading) {
  const std::string text =
      std::string(kRobot) + kEffector + "initial: {joints: [0.3, -0.4], joint_rates: [0.1, 0.2]}\n" + kQuietTarget +
      kGrasp +
      "approach: {duration: 0.12, final_joints: [0.35, -0.3], profile: quintic, final_rates: [0.1, 0.2]}\n"
      "post_impact: {duration: 0.3, joints: pd, kp: 3, kd: 3}\ncontrol: {period: 0.05}\n"
      "sensors: {joints: {bias: 0.01}}\n";
  const CaptureResult r = simulate(text, 0.05);
  const std::vector<std::size_t> approach = samples_of(r, "approach"), post = samples_of(r, "post_impact");
  ASSERT_GE(approach.size(), 3u);
  EXPECT_NEAR(number(r, "joints/reference_position", post[0], 0), number(r, "joints/position", approach[2], 0) + 0.01,
              1e-12);
}

// --- Limits beside stops ---

// The elbow comes to its stop at 0.1 rad/s and more.
std::string stop_text(const std::string& stop) {
  std::string text = capture_text("", "post_impact: {duration: 2}\n");
  const std::string joint = "{name: elbow, type: revolute, axis: [0, 1, 0]";
  text.replace(text.find(joint), joint.size(), joint + ", limits: {lower: -0.43, upper: -0.37, rate: 20" + stop + "}");
  return text;
}

TEST(Outputs, JointAtStopViolatesNoLimitForAnyInterval) {
  for (const std::string& stop : {std::string("0"), std::string("0.5"), std::string("1")}) {
    for (const double interval : {0.5, 0.1, 0.037, 0.01}) {
      const CaptureResult r = simulate(stop_text(", stop: {restitution: " + stop + "}"), interval);
      EXPECT_GT(r.stop_impact_count, 0);
      EXPECT_THAT(r.limit_events, IsEmpty()) << stop << " " << interval << " " << r.limit_events.front().worst_value;
    }
  }
}

TEST(Outputs, LimitEventsIndependentOfInterval) {
  std::vector<LimitEvent> first;
  for (const double interval : {0.5, 0.1, 0.037, 0.01}) {
    const CaptureResult r = simulate(stop_text(""), interval);
    ASSERT_FALSE(r.limit_events.empty());
    if (first.empty()) first = r.limit_events;
    ASSERT_EQ(r.limit_events.size(), first.size());
    for (std::size_t e = 0; e < first.size(); ++e) {
      EXPECT_EQ(r.limit_events[e].begin_time, first[e].begin_time);
      EXPECT_EQ(r.limit_events[e].worst_value, first[e].worst_value);
    }
  }
}

}  // namespace outputs_test
}  // namespace grapnel::testing
