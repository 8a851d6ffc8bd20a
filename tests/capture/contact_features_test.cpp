/// Contacts between shapes together with closed loops, flexible arms, reaction wheels, controllers and several targets:
/// the balances of the ledger, and a number from another route for each.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "capture/scenario_run.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace contact_features_test {

CaptureResult run(const std::string& text) {
  const test::TemporaryFolder folder;
  return simulate_capture(
      load_scenario(folder.write("scenario.yaml", "schema: grapnel-scenario/1\nname: touching\n" + text)));
}

const LedgerEntry& row(const CaptureResult& r, const std::string& name) {
  for (const LedgerEntry& entry : r.ledger.entries) {
    if (entry.name == name) return entry;
  }
  throw std::out_of_range(name);
}

// The run completed, one pair touched at least `touches` times, and momentum and energy are balanced.
void expect_balanced(const CaptureResult& r, int touches, bool momentum = true) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_EQ(r.contacts.size(), 1u);
  EXPECT_GE(r.contacts[0].touches, touches);
  EXPECT_FALSE(r.contacts[0].beyond_model);
  EXPECT_GT(r.contacts[0].impulse, 0.1);
  EXPECT_TRUE(r.ledger.pass());
  for (const char* name : {"linear_momentum_drift", "angular_momentum_drift", "contact_energy_residual"}) {
    EXPECT_TRUE(row(r, name).pass()) << name;
    EXPECT_TRUE(row(r, name).applies || !momentum) << name;
  }
  EXPECT_TRUE(row(r, "contact_energy_residual").applies);
}

// --- Closed loops ---

const std::string kWall =
    "obstacles: [{name: wall, half_space: true, position: [1.27, 0, 0], rpy: [0.02, -1.4, 0.05]}]\n"
    "materials: [{name: pad, stiffness: 4e3, dissipation: 0.5, friction: 0.3}]\n"
    "initial: {base: {velocity: [0.1, 0.01, 0.02], angular_velocity: [0.02, -0.01, 0.03]}, joints: ";

// Two parallel slides hold a box by two rigid grasps; the loop has one degree of freedom.
std::string held_by_two_arms() {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 100, inertia: [20, 20, 20]}\n"
         "  links:\n"
         "    - {name: left, parent: base, joint: {name: left-slide, type: prismatic, axis: [1, 0, 0], origin: "
         "{position: [0.5, 0.3, 0]}}, mass: 5, inertia: [0.1, 0.1, 0.1]}\n"
         "    - {name: right, parent: base, joint: {name: right-slide, type: prismatic, axis: [1, 0, 0], origin: "
         "{position: [0.5, -0.3, 0]}}, mass: 5, inertia: [0.1, 0.1, 0.1]}\n"
         "  end_effectors: [{name: tip-1, link: left, position: [0.3, 0, 0]}, {name: tip-2, link: right, position: "
         "[0.3, 0, 0]}]\n" +
         kWall +
         "[0, 0]}\n"
         "targets:\n"
         "  - name: box\n"
         "    mass: 20\n"
         "    inertia: [1, 1, 1]\n"
         "    geometry: {shape: box, size: [0.4, 0.8, 0.4]}\n"
         "    state: {position: [1, 0, 0], velocity: [0.1, 0.04, 0.03], angular_velocity: [0.02, -0.01, 0.03]}\n"
         "    grasp_points: [{name: left, position: [-0.2, 0.3, 0]}, {name: right, position: [-0.2, -0.3, 0]}]\n"
         "grasps: [{end_effector: tip-1, target: box, point: left}, {end_effector: tip-2, target: box, point: "
         "right}]\n"
         "contacts: {pairs: [[box, wall]], material: pad}\n"
         "impact: {law: plastic}\n"
         "post_impact: {duration: 3, joints: free}\n";
}

// The same bodies without a loop: one slide with the mass of both links and the box.
std::string one_slide() {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 100, inertia: [20, 20, 20]}\n"
         "  links:\n"
         "    - name: box\n"
         "      parent: base\n"
         "      joint: {name: slide, type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 30\n"
         "      com: [0.3333333333333333, 0, 0]\n"
         "      inertia: [2.1, 2.8666666666666667, 3.7666666666666667]\n"
         "      geometry: {shape: box, size: [0.4, 0.8, 0.4], position: [0.5, 0, 0]}\n"
         "  end_effectors: [{name: tip, link: box}]\n" +
         kWall +
         "[0]}\n"
         "contacts: {pairs: [[box, wall]], material: pad}\n"
         "motion: {duration: 3, joints: free}\n";
}

TEST(ContactFeatures, ALoopThatHitsAWallMovesAsTheTreeWithoutIt) {
  const CaptureResult loop = run(held_by_two_arms()), tree = run(one_slide());
  expect_balanced(loop, 1, false), expect_balanced(tree, 1, false);
  const PhaseEnd &a = *loop.post_impact_end, &b = *tree.post_impact_end;
  EXPECT_LT(a.joints.position[0], -0.01);  // the slides move
  EXPECT_EQ(loop.contacts[0].touches, tree.contacts[0].touches);
  EXPECT_NEAR(loop.contacts[0].impulse, tree.contacts[0].impulse, 1e-10);              // measured 7e-14
  EXPECT_NEAR(loop.contacts[0].friction_loss, tree.contacts[0].friction_loss, 1e-10);  // measured 5e-16
  EXPECT_LT(norm(a.base.position - b.base.position), 1e-10);                           // measured 1e-12
  EXPECT_LT(norm(a.base.velocity - b.base.velocity), 1e-10);
  EXPECT_LT(norm(a.base.angular_velocity - b.base.angular_velocity), 1e-10);
  EXPECT_NEAR(a.joints.position[0], b.joints.position[0], 1e-10);
}

// --- Flexible arms ---

// A ball meets the tip of a flexible arm: the arm bends, springs back and meets it again.
std::string flexible_arm(int segments) {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 200, inertia: [50, 50, 50]}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: base\n"
         "      joint: {name: mount, type: fixed, origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 4\n"
         "      com: [1, 0, 0]\n"
         "      inertia: [0.01, 1.34, 1.34]\n"
         "      beam: {to: [2, 0, 0], bending_stiffness_z: 40, damping_ratio: 0.01, segments: " +
         std::to_string(segments) +
         "}\n"
         "    - name: tip\n"
         "      parent: arm\n"
         "      joint: {name: tip-mount, type: fixed, origin: {position: [2, 0, 0]}}\n"
         "      mass: 0.5\n"
         "      inertia: [0.002, 0.002, 0.002]\n"
         "      geometry: {shape: sphere, radius: 0.08}\n"
         "  end_effectors: [{name: end, link: tip}]\n"
         "targets:\n"
         "  - name: ball\n"
         "    mass: 3\n"
         "    inertia: [0.02, 0.02, 0.02]\n"
         "    geometry: {shape: sphere, radius: 0.1}\n"
         "    state: {at: start, position: [2.5, 0.3, 0], velocity: [0, -0.2, 0]}\n"
         "materials: [{name: pad, stiffness: 500, dissipation: 1, friction: 0.3}]\n"
         "contacts: {pairs: [[tip, ball]], material: pad}\n"
         "motion: {duration: 3, joints: free}\n";
}

TEST(ContactFeatures, AFlexibleArmTouchesTwiceAndConvergesWithItsSegments) {
  double impulse[3], speed[3];
  for (int i = 0; i < 3; ++i) {
    const CaptureResult r = run(flexible_arm(2 << i));
    expect_balanced(r, 3);
    impulse[i] = r.contacts[0].impulse, speed[i] = r.post_impact_end->targets[0].velocity[1];
    std::printf("[ measured ] %d segments: %d touches, impulse %.6g N s, ball %.6g m/s\n", 2 << i,
                r.contacts[0].touches, impulse[i], speed[i]);
  }
  EXPECT_LT(std::abs(impulse[2] - impulse[1]), 0.1 * std::abs(impulse[1] - impulse[0]));  // measured 1.5e-4 and 6.2e-3
  EXPECT_LT(std::abs(speed[2] - speed[1]), 0.1 * std::abs(speed[1] - speed[0]));          // measured 5e-5 and 2.1e-3
}

// A ball meets a long link beside the place of a hinge, and slides over it. `beam`: its keys; empty: a rigid link.
std::string ball_on_link(const std::string& beam) {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 200, inertia: [50, 50, 50]}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: base\n"
         "      joint: {name: mount, type: fixed, origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 4\n"
         "      com: [1, 0, 0]\n"
         "      inertia: [0.01, 1.34, 1.34]\n" +
         beam +
         "      geometry: {shape: capsule, radius: 0.05, length: 1.9, position: [1, 0, 0], rpy: [0, "
         "1.5707963267948966, 0]}\n"
         "  end_effectors: [{name: end, link: arm}]\n"
         "targets:\n"
         "  - name: ball\n"
         "    mass: 3\n"
         "    inertia: [0.02, 0.02, 0.02]\n"
         "    geometry: {shape: sphere, radius: 0.1}\n"
         "    state: {at: start, position: [1.65, 0.17, 0], velocity: [0.5, -0.2, 0]}\n"
         "materials: [{name: pad, stiffness: 2e3, dissipation: 0.5, friction: 0.3}]\n"
         "contacts: {pairs: [[arm, ball]], material: pad}\n"
         "motion: {duration: 0.4, joints: free}\n";
}

// The hinges of two segments are at 0.2113, 0.7887, 1.2113 and 1.7887 m of the beam; the ball is at 1.2113 m, which is
// x = 1.7113 m, while it touches. Two capsules there would be twice as stiff.
TEST(ContactFeatures, ABallMeetsOneSurfaceAtTheHingesOfAStiffLink) {
  const CaptureResult rigid = run(ball_on_link(""));
  expect_balanced(rigid, 1);
  double deviation[2];
  for (int i = 0; i < 2; ++i) {
    const CaptureResult flexible = run(ball_on_link(
        i == 0 ? "      beam: {to: [2, 0, 0], bending_stiffness_z: 4e4, damping_ratio: 0.01, segments: 2}\n"
               : "      beam: {to: [2, 0, 0], bending_stiffness_z: 4e5, damping_ratio: 0.01, segments: 2}\n"));
    expect_balanced(flexible, 1);
    const ContactPairReport &a = flexible.contacts[0], &b = rigid.contacts[0];
    EXPECT_EQ(a.touches, b.touches);
    deviation[i] = std::abs(a.peak_force / b.peak_force - 1);
    std::printf(
        "[ measured ] peak %.6g N (%.6g), duration %.6g s (%.6g), impulse %.6g N s (%.6g), loss %.6g J (%.6g)\n",
        a.peak_force, b.peak_force, a.duration, b.duration, a.impulse, b.impulse, a.friction_loss, b.friction_loss);
  }
  EXPECT_LT(deviation[1], 0.01);
  EXPECT_LT(deviation[1], 0.3 * deviation[0]);
}

// --- Reaction wheels ---

std::string wheels_and_controller() {
  return "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 120, inertia: [25, 22, 20]}\n"
         "  wheels:\n"
         "    - {name: wheel-x, axis: [1, 0, 0], inertia: 0.02, torque: 2, rate: 600}\n"
         "    - {name: wheel-y, axis: [0, 1, 0], inertia: 0.02, torque: 2, rate: 600}\n"
         "    - {name: wheel-z, axis: [0, 0, 1], inertia: 0.02, torque: 2, rate: 600}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: base\n"
         "      joint: {name: shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 6\n"
         "      com: [0.5, 0, 0]\n"
         "      inertia: [0.02, 0.5, 0.5]\n"
         "      geometry: {shape: capsule, radius: 0.06, length: 1, position: [0.5, 0, 0], rpy: [0, "
         "1.5707963267948966, 0]}\n"
         "  end_effectors: [{name: tip, link: arm, position: [1, 0, 0]}]\n"
         "initial: {joints: [0]}\n"
         "targets:\n"
         "  - name: ball\n"
         "    mass: 5\n"
         "    inertia: [0.05, 0.05, 0.05]\n"
         "    geometry: {shape: sphere, radius: 0.15}\n"
         "    state: {at: start, position: [1.2, 0.4, 0.05], velocity: [0, -0.1, 0], angular_velocity: [0, 0, 1]}\n"
         "materials: [{name: pad, stiffness: 2e3, dissipation: 0.5, friction: 0.3}]\n"
         "contacts: {pairs: [[arm, ball]], material: pad}\n"
         "motion: {duration: 120, joints: pd, kp: 20, kd: 30, base_control: {kp: 3, kd: 20, rpy: [0, 0, 0]}}\n"
         "output: {interval: 0.5}\n";
}

TEST(ContactFeatures, WheelsTakeTheAngularMomentumOfAContact) {
  const CaptureResult r = run(wheels_and_controller());
  expect_balanced(r, 1);
  const BodyMotion& ball = r.post_impact_end->targets[0];
  EXPECT_LT(norm(r.post_impact_end->base.angular_velocity), 1e-6);
  // What the ball lost, about the initial centre of mass of the robot, which moves along its momentum.
  const Vector3d com{6.0 / 126, 0, 0};
  const Vector3d p_before = 5.0 * Vector3d{0, -0.1, 0}, p_after = 5.0 * ball.velocity;
  const Vector3d before = cross(Vector3d{1.2, 0.4, 0.05} - com, p_before) + 0.05 * Vector3d{0, 0, 1};
  const Vector3d after = cross(ball.position - com, p_after) + 0.05 * ball.angular_velocity;
  Vector3d wheels;
  for (int k = 0; k < 3; ++k) wheels[k] = r.wheels[k].momentum_after();
  const Vector3d transferred = before - after;
  EXPECT_GT(norm(transferred), 0.05);
  EXPECT_LT(norm(wheels - transferred), 2e-6);  // measured 5e-7, the arm still moves
}

// --- Two targets ---

// Two balls in a central impact: the impulse and the loss of the material's coefficient of restitution.
TEST(ContactFeatures, TwoTargetsMeetWithTheirRestitution) {
  const std::string ball = "geometry: {shape: sphere, radius: 0.2}, inertia: [0.05, 0.05, 0.05]";
  const CaptureResult r = run(
      "robot: {name: r, base: {name: base, mass: 50, inertia: [5, 5, 5]}, links: [{name: arm, parent: base, joint: "
      "{name: j, type: revolute, axis: [0, 0, 1]}, mass: 1, inertia: [0.1, 0.1, 0.1]}], end_effectors: [{name: tip, "
      "link: arm}]}\n"
      "initial: {joints: [0]}\n"
      "targets:\n"
      "  - {name: first, mass: 6, " +
      ball +
      ", state: {at: start, position: [2, 0, 0], velocity: [0.06, 0, 0]}}\n"
      "  - {name: second, mass: 3, " +
      ball +
      ", state: {at: start, position: [2.5, 0, 0], velocity: [-0.04, 0, 0]}}\n"
      "materials: [{name: pad, stiffness: 2e3, restitution: 0.6, restitution_speed: 0.1}]\n"
      "contacts: {pairs: [[first, second]], material: pad}\n"
      "motion: {duration: 3, joints: free}\n");
  expect_balanced(r, 1);
  const double reduced = 6.0 * 3 / 9, impulse = reduced * 0.1 * 1.6;
  EXPECT_NEAR(r.contacts[0].first_time.value(), 1, 1e-12);
  EXPECT_NEAR(r.contacts[0].impulse, impulse, 1e-7);
  EXPECT_NEAR(r.contacts[0].damping_loss, 0.5 * reduced * 0.01 * (1 - 0.36), 1e-8);
  EXPECT_NEAR(r.post_impact_end->targets[0].velocity[0], 0.06 - impulse / 6, 1e-7);
  EXPECT_NEAR(r.post_impact_end->targets[1].velocity[0], -0.04 + impulse / 3, 1e-7);
}

// --- Beyond the model ---

// A capsule of radius 0.05 m and a crossed one of 0.03 m, whose axes meet half-way.
const std::string kCrossedBars =
    "obstacles: [{name: post, geometry: {shape: capsule, radius: 0.03, length: 0.3, rpy: [1.5707963267948966, 0, 0]}, "
    "position: [0, 0, 0]}]\n"
    "materials: [{name: pad, stiffness: 2e3}]\n";
const std::string kBar = "geometry: {shape: capsule, radius: 0.05, length: 0.4, rpy: [0, 1.5707963267948966, 0]}";

// The first overlap with the axis of one inside of the other one, at this distance of the axes from each other.
void expect_beyond_model(const CaptureResult& r, double distance_then) {
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const ContactPairReport& pair = r.contacts.at(0);
  ASSERT_TRUE(pair.beyond_model && pair.beyond_model_since && pair.beyond_model_depth);
  EXPECT_NEAR(*pair.beyond_model_depth, 0.03, 0.01);  // measured 0.0287: of the Gauss points along the axes
  EXPECT_NEAR(distance_then, 0.05, 1e-9);             // measured 1e-12
  EXPECT_TRUE(row(r, "contact_energy_residual").applies);
  ASSERT_EQ(r.warnings.size(), 1U);
  EXPECT_TRUE(r.warnings[0].starts_with("contact too deep for the model: "));
}

TEST(ContactFeatures, DriveThatPressesCapsulesThroughEachOtherIsReported) {
  const CaptureResult r =
      run("robot: {name: r, base: {name: base, mode: fixed, mass: 50, inertia: [5, 5, 5]}, links: [{name: arm, parent: "
          "base, joint: {name: j, type: prismatic, axis: [0, 0, 1]}, mass: 1, inertia: [0.1, 0.1, 0.1], " +
          kBar + "}], end_effectors: [{name: tip, link: arm}]}\ninitial: {joints: [-0.2]}\n" + kCrossedBars +
          "contacts: {pairs: [[arm, post]], material: pad}\n"
          "approach: {duration: 1, profile: quintic, final_joints: [0.2]}\n"
          "clearance: {enabled: false}\n");
  const auto moved = [](double t) { return -0.2 + 0.4 * t * t * t * (10 - 15 * t + 6 * t * t); };
  ASSERT_FALSE(r.contacts.empty());
  const ContactPairReport& pair = r.contacts[0];
  expect_beyond_model(r, -moved(pair.beyond_model_since.value_or(0)));
  // Contact ends on the other side.
  EXPECT_EQ(pair.touches, 1);
  EXPECT_NEAR(moved(pair.first_time.value()), -0.08, 1e-9);
  EXPECT_NEAR(pair.duration, 1 - 2 * *pair.first_time, 1e-9);
}

// The elastic energy (23.4a) is a hill, whose top is 0.43 J where the axes cross: a bar with 1 J passes it, and has the
// same velocity afterwards.
TEST(ContactFeatures, FastBarThatPassesThroughAPostIsReported) {
  const CaptureResult r = run(
      "robot: {name: r, base: {name: base, mass: 50, inertia: [5, 5, 5]}, links: [{name: arm, parent: base, joint: "
      "{name: j, type: revolute, axis: [0, 0, 1]}, mass: 1, inertia: [0.1, 0.1, 0.1]}], end_effectors: [{name: tip, "
      "link: arm}]}\ninitial: {joints: [0], base: {position: [3, 0, 0]}}\n"
      "targets: [{name: bar, mass: 2, inertia: [0.05, 0.05, 0.05], " +
      kBar + ", state: {at: start, position: [0, 0, -0.2], velocity: [0, 0, 1]}}]\n" + kCrossedBars +
      "contacts: {pairs: [[bar, post]], material: pad}\n"
      "clearance: {enabled: false}\nmotion: {duration: 1, joints: free}\n");
  ASSERT_FALSE(r.contacts.empty());
  EXPECT_TRUE(r.contacts[0].beyond_model);
  const Vector3d after = r.post_impact_end->targets.at(0).velocity;
  EXPECT_NEAR(after[2], 1, 1e-7);
  EXPECT_EQ(r.contacts[0].touches, 1);
}

// --- Controllers ---

// A robot fixed to the ground moves its finger to a point 0.02 m inside of a wall. Its control does not know the wall's
// force: at rest m k_p e = k d with e + d = 0.02 m, as for a spring of stiffness m k_p.
TEST(ContactFeatures, ComputedTorqueDoesNotKnowTheForceOfAContact) {
  constexpr double kMass = 5, kGain = 400, kStiffness = 4e3, kReach = 0.02;
  std::string text =
      "schema: grapnel-scenario/1\nname: pressing\n" + sliding_arm(", mode: fixed") +
      "obstacles: [{name: wall, half_space: true, position: [0.83, 0, 0], rpy: [0, -1.5707963267948966, 0]}]\n"
      "materials: [{name: pad, stiffness: 4e3, dissipation: 0.5}]\n"
      "contacts: {pairs: [[arm, wall]], material: pad}\n"
      "motion: {duration: 8, joints: computed_torque, kp: 400, kd: 40, move: {joints: [0.05], duration: 2}}\n";
  for (const char* control : {"", "control: {period: 0.001}\n"}) {
    SCOPED_TRACE(control);
    const CaptureResult r = testing::run(text + control);
    expect_sound(r);
    const double depth = kMass * kGain * kReach / (kStiffness + kMass * kGain);
    EXPECT_NEAR(r.post_impact_end->joints.position.at(0), 0.05 - kReach + depth, 1e-7);
  }
}

}  // namespace contact_features_test
}  // namespace grapnel::testing
