/// Coupled joints in whole runs: a reduced model of one degree of freedom, a flywheel against the equivalent rotor in
/// approach, impact and motion afterwards, stops, a parallel gripper that holds a box by contact, and faults.

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
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace coupled_joints_test {

using ::testing::HasSubstr;

// ---- Two pendulums geared to each other ----

// On the ground, axes along y, gravity along -z: theta_2 = r theta_1 + phi.
constexpr double kRatio = -1.7, kPhase = 0.4, kMass1 = 2, kMass2 = 1.5, kLength1 = 0.6, kLength2 = 0.4, kInertia = 0.02;

std::string pendulums() {
  const auto link = [](const char* name, double mass, double length, const std::string& more) {
    return fmt::format(
        "    - {{name: {0}, parent: base, mass: {1}, com: [0, 0, {2}], inertia: [{3}, {3}, {3}], joint: {{name: "
        "{0}, type: revolute, axis: [0, 1, 0]{4}}}}}\n",
        name, mass, -length, kInertia, more);
  };
  return "schema: grapnel-scenario/1\nname: pendulums\nrobot:\n  name: pendulums\n"
         "  base: {name: base, mode: fixed, mass: 10, inertia: [1, 1, 1]}\n  links:\n" +
         link("first", kMass1, kLength1, "") +
         link("second", kMass2, kLength2,
              fmt::format(", mimic: {{joint: first, ratio: {}, offset: {}}}", kRatio, kPhase)) +
         fmt::format("initial: {{joints: {{first: 0.9, second: {}}}}}\n", kRatio * 0.9 + kPhase) +
         "gravity: [0, 0, -9.81]\nmotion: {duration: 4}\noutput: {interval: 0.5}\n";
}

// The reduced equation (I_1 + r^2 I_2) theta'' = -m_1 g l_1 sin(theta) - r m_2 g l_2 sin(r theta + phi), by classical
// Runge-Kutta steps of 0.1 ms.
double reduced_angle(double theta, double duration) {
  const double I =
      kMass1 * kLength1 * kLength1 + kInertia + kRatio * kRatio * (kMass2 * kLength2 * kLength2 + kInertia);
  const auto f = [&](double x) {
    return -9.81 * (kMass1 * kLength1 * std::sin(x) + kRatio * kMass2 * kLength2 * std::sin(kRatio * x + kPhase)) / I;
  };
  double w = 0;
  const int steps = static_cast<int>(std::lround(duration / 1e-4));
  for (int i = 0; i < steps; ++i) {
    const double h = 1e-4, k1 = f(theta), k2 = f(theta + 0.5 * h * w), k3 = f(theta + 0.5 * h * w + 0.25 * h * h * k1),
                 k4 = f(theta + h * w + 0.5 * h * h * k2);
    theta += h * w + h * h / 6 * (k1 + k2 + k3);
    w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return theta;
}

TEST(CoupledPendulums, MoveAsOneDegreeOfFreedom) {
  const CaptureResult r = run(pendulums());
  expect_sound(r);
  const Series& angles = series(r, "joints/position");
  const double expected = reduced_angle(0.9, 4);
  const std::size_t last = angles.data.size() - 2;
  EXPECT_NEAR(angles.data[last], expected, 1e-8);
  EXPECT_NEAR(angles.data[last + 1], kRatio * angles.data[last] + kPhase, 1e-12);
  EXPECT_LT(std::abs(expected - 0.9), 3);
  EXPECT_GT(std::abs(expected - 0.9), 0.1);
  // The coupling moves the second pendulum: I_2 theta_2'' + m_2 g l_2 sin(theta_2) is its effort, largest at the start.
  const double I_2 = kMass2 * kLength2 * kLength2 + kInertia, I = kMass1 * kLength1 * kLength1 + kInertia;
  const double theta = 0.9, theta_2 = kRatio * theta + kPhase, pull_2 = 9.81 * kMass2 * kLength2 * std::sin(theta_2);
  const double vdot = -(9.81 * kMass1 * kLength1 * std::sin(theta) + kRatio * pull_2) / (I + kRatio * kRatio * I_2);
  EXPECT_NEAR(series(r, "couplings/effort").data.front(), I_2 * kRatio * vdot + pull_2, 1e-10);
}

// ---- A flywheel geared to the shoulder, and the same as its rotor ----

enum class Form { flywheel, rotor };

// The flywheel turns `gear` times as fast as the shoulder relative to the base, about another axis: so does the
// rotor of a motor whose axis is stated, which the base carries and includes.
std::string servicer(Form form, const std::string& rest) {
  const bool fly = form == Form::flywheel;
  return std::string("schema: grapnel-scenario/1\nname: geared\nrobot:\n  name: geared\n") +
         (fly ? "  base: {name: base, mass: 60, inertia: [6, 7, 8]}\n"
              : "  base: {name: base, mass: 64, inertia: [6.03, 7.05, 8.03]}\n") +
         "  links:\n"
         "    - {name: upper, parent: base, mass: 5, com: [0.4, 0, 0.02], inertia: [0.05, 0.3, 0.3], joint: {name: "
         "shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0.1, 0.2]}, limits: {effort: 400}" +
         (fly ? "}}\n" : ", rotor_inertia: 0.05, gear_ratio: 9, rotor_axis: [0, 1, 0]}}\n") +
         "    - {name: lower, parent: upper, mass: 4, com: [0.3, 0.01, 0], inertia: [0.04, 0.2, 0.2], joint: {name: "
         "elbow, type: revolute, axis: [0, 1, 0], origin: {position: [0.8, 0, 0]}}}\n" +
         (fly ? "    - {name: fly, parent: base, mass: 4, inertia: [0.03, 0.05, 0.03], joint: {name: spin, type: "
                "continuous, axis: [0, 1, 0], mimic: {joint: shoulder, ratio: 9}}}\n"
              : "") +
         "  end_effectors: [{name: tip, link: lower, position: [0.7, 0, 0]}]\n"
         "initial: {base: {momentum: {linear: [0.5, -0.2, 0.1], angular: [0.3, 0.2, -0.4]}}, joints: " +
         (fly ? "{shoulder: 0.3, elbow: -0.4, spin: 2.7}" : "{shoulder: 0.3, elbow: -0.4}") +
         "}\n"
         "targets:\n"
         "  - {name: box, mass: 25, inertia: [2, 3, 2.5], com: [0.1, 0.05, 0], state: {at: capture, position: [2, 0.5, "
         "0.3], velocity: [-0.1, 0.05, 0.02], angular_velocity: [0.05, -0.1, 0.2]}, grasp_points: [{name: handle, "
         "position: [-0.2, 0, 0], normal: [-1, 0, 0]}]}\n" +
         rest;
}
std::string approach(Form form, const std::string& tracking) {
  return std::string("approach: {duration: 4, final_joints: ") +
         (form == Form::flywheel
              ? "{shoulder: 0.6, elbow: -0.1, spin: 5.4}, final_rates: {shoulder: 0.1, elbow: -0.2, spin: 0.9}"
              : "{shoulder: 0.6, elbow: -0.1}, final_rates: {shoulder: 0.1, elbow: -0.2}") +
         ", tracking: {" + tracking + "}}\ncontact: {gap: weld_as_found, largest_gap: any}\n";
}
std::string per_joint(Form form, double value) {
  return form == Form::flywheel ? fmt::format("{{shoulder: {0}, elbow: {0}, spin: 0}}", value)
                                : fmt::format("{{shoulder: {0}, elbow: {0}}}", value);
}

double apart(const Vector3d& a, const Vector3d& b) { return norm(a - b); }

// Largest difference of the two runs in impulse, base and target at the end.
void expect_equal(const CaptureResult& fly, const CaptureResult& rotor, double tolerance) {
  expect_sound(fly);
  expect_sound(rotor);
  const BodyMotion &a = fly.post_impact_end->base, &b = rotor.post_impact_end->base;
  EXPECT_LT(apart(a.position, b.position), tolerance);
  EXPECT_LT(apart(a.angular_velocity, b.angular_velocity), tolerance);
  EXPECT_LT(apart(a.velocity, b.velocity), tolerance);
  EXPECT_GT(norm(a.angular_velocity), 1e-3);
  const BodyMotion &c = fly.post_impact_end->targets[0], &d = rotor.post_impact_end->targets[0];
  EXPECT_LT(apart(c.angular_velocity, d.angular_velocity), tolerance);
  EXPECT_LT(apart(c.velocity, d.velocity), tolerance);
  ASSERT_EQ(fly.impact()->grasps.size(), rotor.impact()->grasps.size());
  EXPECT_GT(fly.impact()->grasps[0].impulse_magnitude, 0.1);
  EXPECT_LT(apart(fly.impact()->grasps[0].impulse, rotor.impact()->grasps[0].impulse), tolerance);
  // The energies differ by none: the rotor's are included.
  EXPECT_NEAR(fly.impact()->kinetic_energy_after - fly.impact()->kinetic_energy_before,
              rotor.impact()->kinetic_energy_after - rotor.impact()->kinetic_energy_before, tolerance);
}

CaptureResult capture(Form form, const std::string& tracking, const std::string& impact, const std::string& after,
                      const std::string& grasp = "") {
  const double kp = 40, kd = 60;
  const auto gains = [&](std::string text) {
    const auto put = [&](const std::string& key, const std::string& value) {
      if (const auto at = text.find(key); at != std::string::npos) text.replace(at, key.size(), value);
    };
    put("KP", per_joint(form, kp)), put("KD", per_joint(form, kd));
    return text;
  };
  return run(servicer(form, "grasps: [{end_effector: tip, target: box, point: handle" + grasp + "}]\n" +
                                approach(form, gains(tracking)) + "impact: {duration: 10 ms, " + impact + "}\n" +
                                "post_impact: {duration: 2, " + gains(after) + "}\noutput: {interval: 0.5}\n"));
}

struct Case {
  const char *tracking, *impact, *after;
  double tolerance;
};

TEST(GearedFlywheel, EqualsTheRotorOfAMotorInAllPhases) {
  const Case cases[] = {
      {"mode: ideal", "law: plastic", "joints: free", 1e-7},
      {"mode: ideal", "law: plastic, joints: driven", "joints: braked", 1e-7},
      {"mode: ideal", "law: plastic, joints: braked", "joints: pd, kp: KP, kd: KD", 1e-7},
      {"mode: pd, kp: KP, kd: KD", "law: bilateral_restitution, restitution: 0.3", "joints: pd, kp: KP, kd: KD", 1e-7},
      {"mode: computed_torque, kp: 4, kd: 4", "law: plastic", "joints: computed_torque, kp: 4, kd: 4", 1e-7},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(std::string(c.tracking) + "; " + c.impact + "; " + c.after);
    const CaptureResult fly = capture(Form::flywheel, c.tracking, c.impact, c.after);
    expect_equal(fly, capture(Form::rotor, c.tracking, c.impact, c.after), c.tolerance);
    ASSERT_FALSE(fly.loops.empty());
    EXPECT_EQ(fly.loops.front().closures, std::vector<std::string>{"spin"});
  }
}

TEST(GearedFlywheel, EqualsTheRotorInAnImpactWithFriction) {
  const std::string impact = "law: friction, restitution: 0.5, friction: 0.2";
  const CaptureResult fly = capture(Form::flywheel, "mode: ideal", impact, "joints: free", ", model: contact");
  expect_equal(fly, capture(Form::rotor, "mode: ideal", impact, "joints: free", ", model: contact"), 1e-7);
  EXPECT_TRUE(fly.impact()->grasps[0].rebound.has_value());
}

// ---- A parallel gripper ----

// Two fingers slide along y towards each other, each other's mirror image. The motor of the left one gives at most
// kForce; with a coupling it holds both pads.
constexpr double kForce = 30;

std::string gripper(const std::string& right, const std::string& gains) {
  return "schema: grapnel-scenario/1\nname: gripper\nrobot:\n  name: gripper\n"
         "  base: {name: hand, mass: 20, inertia: [0.4, 0.4, 0.4]}\n  links:\n"
         "    - {name: left, parent: hand, mass: 0.4, inertia: [1e-3, 1e-3, 1e-3], geometry: {shape: box, size: [0.1, "
         "0.02, 0.06]}, joint: {name: left, type: prismatic, axis: [0, -1, 0], origin: {position: [0.2, 0.11, 0]}, "
         "limits: {effort: 30}}}\n"
         "    - {name: right, parent: hand, mass: 0.4, inertia: [1e-3, 1e-3, 1e-3], geometry: {shape: box, size: "
         "[0.1, 0.02, 0.06]}, joint: {name: right, type: prismatic, axis: [0, 1, 0], origin: {position: [0.2, -0.11, "
         "0]}, limits: {effort: 30}" +
         right +
         "}}\n"
         "initial: {joints: {left: 0, right: 0}}\n"
         "targets: [{name: box, mass: 6, inertia: [0.03, 0.03, 0.03], geometry: {shape: box, size: [0.16, 0.14, "
         "0.16]}, state: {at: start, position: [0.2, 0.01, 0], velocity: [0.02, 0, 0.01]}}]\n"
         "materials: [{name: pad, stiffness: 5e3, damping: 100, friction: 0.5, stiction_displacement: 5e-4}]\n"
         "integration: {relative_tolerance: 1e-10, absolute_tolerance: 1e-11}\n"
         "contacts: {pairs: [[left, box], [right, box]], material: pad}\n"
         "motion: {duration: 5, joints: pd, " +
         gains + ", move: {joints: {left: 0.06, right: 0.06}, duration: 2}}\noutput: {interval: 0.05}\n";
}

double last_force(const CaptureResult& r, const std::string& path) { return series(r, path).data.back(); }

// Largest velocity of the box relative to the hand at the end [m/s], and rotation [rad/s].
double slip(const CaptureResult& r) {
  const BodyMotion &hand = r.post_impact_end->base, &box = r.post_impact_end->targets[0];
  const Vector3d carried = hand.velocity + cross(hand.angular_velocity, box.position - hand.position);
  return std::max(norm(box.velocity - carried), norm(box.angular_velocity - hand.angular_velocity));
}

TEST(ParallelGripper, HoldsABoxWithHalfTheForceOfItsMotor) {
  const CaptureResult r =
      run(gripper(", mimic: {joint: left}", "kp: {left: 2000, right: 0}, kd: {left: 300, right: 0}"));
  expect_sound(r);
  ASSERT_EQ(r.contacts.size(), 2u);
  for (const ContactPairReport& pair : r.contacts) EXPECT_TRUE(pair.touches_at_end);
  // The motor reaches its limit; each pad receives half of it, the other half passes through the coupling.
  const Series& effort = series(r, "joints/effort");
  EXPECT_NEAR(effort.data[effort.data.size() - 2], kForce, 1e-9);
  EXPECT_EQ(effort.data.back(), 0);
  EXPECT_NEAR(last_force(r, "contacts/left--box/normal_force"), kForce / 2, 1e-2);
  EXPECT_NEAR(last_force(r, "contacts/right--box/normal_force"), kForce / 2, 1e-2);
  EXPECT_NEAR(series(r, "couplings/effort").data.back(), kForce / 2, 1e-2);
  EXPECT_LT(slip(r), 1e-5);
  const Series& position = series(r, "joints/position");
  EXPECT_NEAR(position.data.back(), position.data[position.data.size() - 2], 1e-12);
}

// The coupling is part of the impact: without it the impulses would not balance.
TEST(ParallelGripper, BouncesABoxBetweenHardPads) {
  std::string text = gripper(", mimic: {joint: left}", "kp: {left: 0, right: 0}, kd: {left: 0, right: 0}");
  const auto replace = [&](const std::string& old, const std::string& by) {
    ASSERT_NE(text.find(old), std::string::npos) << old;
    text.replace(text.find(old), old.size(), by);
  };
  replace("damping: 100, friction: 0.5", "hard: true, restitution: 0.6, friction: 0.2");
  replace("velocity: [0.02, 0, 0.01]", "velocity: [0.02, 0.1, 0.01]");
  const CaptureResult r = run(text);
  expect_sound(r);
  int impacts = 0;
  for (const ContactPairReport& pair : r.contacts) impacts += pair.hard->impacts;
  EXPECT_GE(impacts, 1);
}

TEST(ParallelGripper, HoldsWithBothMotorsAtTheirLimits) {
  const CaptureResult r = run(gripper("", "kp: 2000, kd: 300"));
  expect_sound(r);
  EXPECT_NEAR(last_force(r, "contacts/left--box/normal_force"), kForce, 0.05);
  EXPECT_NEAR(last_force(r, "contacts/right--box/normal_force"), kForce, 0.05);
  // Saturated motors have no stiffness: fingers and box drift together along y until one motor leaves its limit.
  EXPECT_LT(slip(r), 1e-3);
}

// ---- Plans ----

// An arm of three joints with two coupled fingers beside the palm that grasps.
TEST(CoupledFingers, AreKeptStillByPlansAndMovedAfterwards) {
  const CaptureResult r = run(
      "schema: grapnel-scenario/1\nname: planned\nrobot:\n  name: planned\n"
      "  base: {name: base, mass: 100, inertia: [10, 12, 14]}\n  links:\n"
      "    - {name: a, parent: base, mass: 5, com: [0.3, 0, 0], inertia: [0.05, 0.2, 0.2], joint: {name: a, type: "
      "revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0]}}}\n"
      "    - {name: b, parent: a, mass: 4, com: [0.3, 0, 0], inertia: [0.05, 0.15, 0.15], joint: {name: b, type: "
      "revolute, axis: [0, 1, 0], origin: {position: [0.6, 0, 0]}}}\n"
      "    - {name: c, parent: b, mass: 3, com: [0.2, 0, 0], inertia: [0.03, 0.1, 0.1], joint: {name: c, type: "
      "revolute, axis: [0, 1, 0], origin: {position: [0.6, 0, 0]}}}\n"
      "    - {name: left, parent: c, mass: 0.3, inertia: [1e-3, 1e-3, 1e-3], joint: {name: left, type: prismatic, "
      "axis: [0, -1, 0], origin: {position: [0.45, 0.05, 0]}}}\n"
      "    - {name: right, parent: c, mass: 0.3, inertia: [1e-3, 1e-3, 1e-3], joint: {name: right, type: prismatic, "
      "axis: [0, 1, 0], origin: {position: [0.45, -0.05, 0]}, mimic: {joint: left}}}\n"
      "  end_effectors: [{name: palm, link: c, position: [0.4, 0, 0]}]\n"
      "initial: {joints: {a: 0.1, b: -0.6, c: 1, left: 0.01}}\n"
      "targets: [{name: box, mass: 25, inertia: [2, 3, 2.5], state: {at: capture, position: [1.9, 0.5, 0.2], velocity: "
      "[0.01, 0, 0], angular_velocity: [0.02, -0.01, 0.05]}, grasp_points: [{name: handle, position: [-0.1, 0, 0]}]}]\n"
      "grasps: [{end_effector: palm, target: box, point: handle, model: point}]\n"
      "approach: {duration: 10, plan: {objective: impulse}, tracking: {mode: computed_torque, kp: 9, kd: 6}}\n"
      "impact: {law: plastic}\n"
      "post_impact: {duration: 4, joints: pd, kp: {a: 50, b: 50, c: 50, left: 500}, kd: {a: 50, b: 50, c: 50, left: "
      "100}, move: {joints: {a: 0.1, b: -0.6, c: 1, left: 0.03}, duration: 2}}\noutput: {interval: 1}\n");
  expect_sound(r);
  ASSERT_TRUE(r.approach_end);
  EXPECT_NEAR(r.approach_end->joints.position[3], 0.01, 1e-9);
  EXPECT_NEAR(r.approach_end->joints.position[4], 0.01, 1e-9);
  EXPECT_NEAR(r.post_impact_end->joints.position[3], 0.03, 1e-3);
  EXPECT_NEAR(r.post_impact_end->joints.position[4], r.post_impact_end->joints.position[3], 1e-12);
}

// ---- Stops ----

// The fingers move at 0.1 m/s towards the stops at 50 mm, of one finger or of both at the same instant.
TEST(CoupledStops, ReverseAllCoupledJoints) {
  const std::string stop = ", stop: {restitution: 0.5}";
  for (const auto& [left, right] :
       {std::pair(stop, stop), std::pair(stop, std::string()), std::pair(std::string(), stop)}) {
    const auto finger = [](const char* name, const char* axis, double y, const std::string& limit, const char* more) {
      return fmt::format(
          "    - {{name: {0}, parent: hand, mass: 0.4, inertia: [1e-3, 1e-3, 1e-3], joint: {{name: {0}, type: "
          "prismatic, axis: {1}, origin: {{position: [0.2, {2}, 0]}}, limits: {{lower: 0, upper: 0.05{3}}}{4}}}}}\n",
          name, axis, y, limit, more);
    };
    const CaptureResult r = run(
        "schema: grapnel-scenario/1\nname: stops\nrobot:\n  name: gripper\n"
        "  base: {name: hand, mass: 20, inertia: [0.4, 0.4, 0.4]}\n  links:\n" +
        finger("left", "[0, -1, 0]", 0.1, left, "") +
        finger("right", "[0, 1, 0]", -0.1, right, ", mimic: {joint: left}") +
        "initial: {joints: {left: 0.02}, joint_rates: {left: 0.1}}\nmotion: {duration: 1}\noutput: {interval: 0.1}\n");
    expect_sound(r);
    const std::vector<double>& rates = series(r, "joints/velocity").data;
    EXPECT_NEAR(rates[0], 0.1, 1e-12);
    EXPECT_NEAR(rates[1], 0.1, 1e-12);  // follows, although not stated
    EXPECT_NEAR(rates[rates.size() - 2], -0.05, 1e-9);
    EXPECT_NEAR(rates.back(), -0.05, 1e-9);
    const std::vector<double>& positions = series(r, "joints/position").data;
    EXPECT_NEAR(positions.back(), 0.05 - 0.05 * 0.7, 1e-9);  // the stop at t = 0.3 s
  }
}

TEST(CoupledJoints, AreIntegratedOnCores) {
  const test::TemporaryFolder folder;
  const CaptureSystem system = make_capture_system(load_scenario(folder.write("scenario.yaml", pendulums())));
  EXPECT_EQ(lanes::lane_obstacle(system.model, PhaseSetup{}, IntegrationSetup{}), "joints are coupled");
}

// ---- Faults ----

std::vector<std::string> gripper_faults(const std::string& right, const std::string& more = "") {
  return test::faults_of(gripper(right, "kp: 2000, kd: 300") + more);
}

TEST(CoupledJointFaults, HaveTheirPlaces) {
  using ::testing::ElementsAre;
  EXPECT_THAT(gripper_faults(", mimic: {joint: lift}"),
              ElementsAre(AllOf(HasSubstr("scenario.yaml:8:"), HasSubstr("names the unknown joint 'lift'"),
                                HasSubstr("did you mean 'left'?"))));
  EXPECT_THAT(gripper_faults(", mimic: {joint: right}"), ElementsAre(HasSubstr("cannot follow itself")));
  EXPECT_THAT(gripper_faults(", mimic: {joint: left, ratio: 0}"), ElementsAre(HasSubstr("ratio is 0")));
  EXPECT_THAT(gripper_faults(", mimic: {joint: left, offset: 5 mm}"),
              ElementsAre(AllOf(HasSubstr("initial.joints"), HasSubstr("makes it 0.005 (violated by -0.005)")),
                          HasSubstr("move.joints: joint 'right' is 0.06, but")));
  EXPECT_THAT(gripper_faults(", mimic: {joint: left, offset: 5 deg}"), ElementsAre(HasSubstr("expected a length")));
  EXPECT_THAT(gripper_faults(", mimic: {joint: left, ratio: 2 mm}"),
              ElementsAre(HasSubstr("mimic.ratio must be a number without unit, not '2 mm'")));
  EXPECT_THAT(gripper_faults(", mimic: {ratio: 2}"),
              ElementsAre(HasSubstr("missing key 'joint' in robot.links[1].joint.mimic")));
  EXPECT_THAT(gripper_faults(", mimic: [{joint: left, ratio: 2}, {joint: left, ratio: -1}]"),
              ElementsAre(HasSubstr("names joint 'left' twice")));
  EXPECT_THAT(gripper_faults(", mimic: {joint: left}, motor: {no_load_rate: 1}"), ElementsAre(HasSubstr("motor")));
}

TEST(CoupledJointFaults, NameTheCoupledJoints) {
  const auto faults = [](const std::string& rest) {
    return test::faults_of(servicer(Form::flywheel,
                                    "grasps: [{end_effector: tip, target: box, point: handle}]\n"
                                    "contact: {gap: weld_as_found, largest_gap: any}\n" +
                                        rest));
  };
  using ::testing::Contains;
  EXPECT_THAT(faults("approach: {duration: 4, plan: {}}\nimpact: {law: plastic}\n"),
              Contains(AllOf(HasSubstr("joint 'shoulder', which carries 'tip'"),
                             HasSubstr("joint 'spin' follows 'shoulder'"))));
  EXPECT_THAT(faults("impact: {law: compliant, grasp: {linear_stiffness: 1e5, angular_stiffness: 1e4}}\n"),
              Contains(HasSubstr("impact.law: compliant does not support coupled joints")));
  EXPECT_THAT(faults("impact: {law: plastic}\npost_impact: {duration: 2, joints: detumble, kp: 1, kd: 1, detumble: "
                     "{torque: 1}}\n"),
              Contains(HasSubstr("post_impact.joints: detumble moves all joints together")));
  EXPECT_THAT(faults("impact: {law: plastic}\npost_impact:\n  - {duration: 2}\n  - {duration: 2, joints: detumble, "
                     "kp: 1, kd: 1, detumble: {torque: 1}}\n"),
              Contains(HasSubstr("post_impact[1].joints: detumble moves all joints together")));
}

}  // namespace coupled_joints_test
}  // namespace grapnel::testing
