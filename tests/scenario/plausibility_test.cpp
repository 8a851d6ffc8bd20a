// Valid but implausible input gives a warning with its location; plausible input gives none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace plausibility_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> warnings_with(const std::vector<Edit>& edits) {
  return warnings_of(edited(kSmallScenario, edits));
}
Edit of_ball(const std::string& mass, const std::string& inertia) {
  return {"mass: 10\n    inertia: [1, 1, 1]", "mass: " + mass + "\n    inertia: " + inertia};
}
Edit with_shape(const std::string& shape) {
  return {"    grasp_points", "    geometry: " + shape + "\n    grasp_points"};
}

TEST(Warnings, NoneForShippedFiles) {
  SKIP_UNDER_SANITIZERS();
  for (const auto& path : shipped_scenarios()) {
    SCOPED_TRACE(path);
    std::vector<Fault> warnings;
    load_scenario(path, {}, &warnings);
    for (const Fault& doubt : warnings) ADD_FAILURE() << doubt.text();
  }
  for (const auto& path : shipped_robots()) {
    SCOPED_TRACE(path);
    std::vector<Fault> warnings;
    load_robot(path, &warnings);
    for (const Fault& doubt : warnings) ADD_FAILURE() << doubt.text();
  }
  EXPECT_THAT(warnings_of(kSmallScenario), IsEmpty());
}

TEST(Warnings, InertiaWithoutAShape) {
  EXPECT_THAT(
      warnings_with({of_ball("8000", "[17, 17, 17]")}),
      ElementsAre("scenario.yaml:24:14: warning: targets[0].inertia: the moment of inertia 17 kg m^2 and the mass "
                  "8000 kg make a radius of gyration of 0.0461 m, and a ball of the densest metal has a larger one; is "
                  "the inertia in t m^2, or the mass in g?"));
  EXPECT_THAT(
      warnings_with({of_ball("8", "[129000, 129000, 129000]")}),
      ElementsAre("scenario.yaml:24:14: warning: targets[0].inertia: the moment of inertia 129000 kg m^2 and the "
                  "mass 8 kg make a radius of gyration of 127 m, and more than 10 m is implausible; is the mass "
                  "in t?"));
  EXPECT_THAT(warnings_with({of_ball("8000", "[17000, 17000, 17000]")}), IsEmpty());
  // A station of 420 t may have a large inertia; a rod may have a small moment of inertia about its axis.
  EXPECT_THAT(warnings_with({of_ball("420000", "[1e8, 1.3e8, 2e8]")}), IsEmpty());
  EXPECT_THAT(warnings_with({of_ball("10", "[0.0001, 3, 3]")}), IsEmpty());
  EXPECT_THAT(
      warnings_with({{"base: {mass: 100, inertia: [10, 10, 10]}", "base: {mass: 100, inertia: [1e6, 1e6, 1e6]}"}}),
      ElementsAre(HasSubstr("scenario.yaml:4:30: warning: robot.base.inertia: the moment of inertia 1e+06 kg m^2")));
  // The check uses the largest principal moment: 2 + 0.9 for this matrix.
  EXPECT_THAT(warnings_with({of_ball("0.01", "[2, 2, 2, 0.9, 0, 0]")}),
              ElementsAre(HasSubstr("the moment of inertia 2.9 kg m^2")));
}

TEST(Warnings, InertiaWithAShape) {
  const Edit ball = with_shape("{shape: sphere, radius: 0.5}");
  EXPECT_THAT(warnings_with({ball}), IsEmpty());
  EXPECT_THAT(warnings_with({ball, of_ball("10", "[40, 40, 40]")}),
              ElementsAre(HasSubstr("make a radius of gyration of 2 m, and the shape ends 0.5 m from the centre of "
                                    "mass")));
  EXPECT_THAT(warnings_with({ball, of_ball("10", "[0.004, 0.004, 0.004]")}),
              ElementsAre(HasSubstr("make a radius of gyration of 0.02 m")));
  EXPECT_THAT(warnings_with({with_shape("{shape: box, size: [0.5, 1, 10]}"), of_ball("10", "[90, 90, 1]")}), IsEmpty());
}

// Panels extend far with little mass. The mass may be in any of the shapes, but not outside all of them.
TEST(Warnings, InertiaWithSeveralShapes) {
  const Edit wings =
      with_shape("[{shape: sphere, radius: 0.5}, {shape: box, size: [0.1, 8, 0.1], position: [0, 4, 0]}]");
  EXPECT_THAT(warnings_with({wings}), IsEmpty());
  EXPECT_THAT(warnings_with({wings, of_ball("10", "[40, 40, 40]")}), IsEmpty());  // 2 m, and the box ends at 8 m
  EXPECT_THAT(warnings_with({wings, of_ball("10", "[8000, 8000, 8000]")}),
              ElementsAre(HasSubstr("make a radius of gyration of 28.3 m, and the shapes end 8 m from the centre of "
                                    "mass")));
  EXPECT_THAT(warnings_with({wings, of_ball("0.5", "[0.0001, 0.0001, 0.0001]")}),
              ElementsAre(HasSubstr("make a radius of gyration of 0.0141 m, and the nearest of the shapes ends 0.5 m "
                                    "from the centre of mass")));
}

TEST(Warnings, GraspPointsOnSeveralShapes) {
  const Edit shapes =
      with_shape("[{shape: sphere, radius: 0.5}, {shape: box, size: [3, 0.1, 0.1], position: [2, 0, 0]}]");
  const auto at = [&](const std::string& position) {
    return warnings_with({shapes, {"{name: grip, position: [0, 0.5, 0]}", "{name: grip, position: " + position + "}"}});
  };
  EXPECT_THAT(at("[3.5, 0, 0]"), IsEmpty());
  EXPECT_THAT(at("[5, 0, 0]"),
              ElementsAre(HasSubstr("is 5 m from the target's origin, and its shapes end at 3.501 m")));
  // The outward direction is away from the target's centre of mass.
  EXPECT_THAT(warnings_with({shapes, with_point("normal: [0, -1, 0]")}),
              ElementsAre(HasSubstr("normal points into the target")));
}

TEST(Warnings, AnglesAndRatesInDegrees) {
  EXPECT_THAT(
      warnings_with({{"state: {position: [2, 0, 0], angular_velocity: [0, 0, 0.2]}",
                      "state: {position: [2, 0, 0], rpy: [0, 0, -90], angular_velocity: [0, 0, 12]}"}}),
      ElementsAre("scenario.yaml:25:46: warning: targets[0].state.rpy[2] is -90 rad, more than a full turn; angles "
                  "are in rad, -90 degrees would be -1.57079633",
                  "scenario.yaml:25:77: warning: targets[0].state.angular_velocity[2] is 12 rad/s, 1.91 turns per "
                  "second; rates are in rad/s, 12 deg/s would be 0.20943951"));
  EXPECT_THAT(
      warnings_with({{"elbow: 1}", "elbow: 45}"}}),
      ElementsAre("scenario.yaml:20:34: warning: initial.joints.elbow is 45 rad, more than a full turn; angles are "
                  "in rad, 45 degrees would be 0.785398163"));
  EXPECT_THAT(warnings_with({{"[0.2, -0.4]", "[0.2, -40]"}}),
              ElementsAre(HasSubstr("approach.final_joints[1] (joint 'elbow') is -40 rad")));
  EXPECT_THAT(warnings_with({{"{match: velocity}", "{elbow: 10}"}}),
              ElementsAre(HasSubstr("approach.final_rates.elbow is 10 rad/s")));
  // A prismatic joint may move ten metres; a full turn is plausible.
  EXPECT_THAT(
      warnings_with({{"{name: elbow, type: revolute", "{name: elbow, type: prismatic"}, {"elbow: 1}", "elbow: 10}"}}),
      IsEmpty());
  EXPECT_THAT(warnings_with({{"elbow: 1}", "elbow: 6.283185307179586}"}}), IsEmpty());
}

// Rates of hundreds of rad/s are plausible for wheels but not for gimbals.
TEST(Warnings, RatesOfWheelsAndRotors) {
  const auto with_wheels = [](const std::string& wheels, const std::string& initial) {
    return warnings_with(
        {{"base: {mass: 100, inertia: [10, 10, 10]}", "base: {mass: 100, inertia: [10, 10, 10]}\n  " + wheels},
         {"elbow: 1}\n", "elbow: 1}\n" + initial}});
  };
  const std::string array = "wheel_array: {configuration: orthogonal, inertia: 0.01, rate: ";
  EXPECT_THAT(with_wheels(array + "6000}", "  wheel_rates: [300, -300, 6000]\n"), IsEmpty());
  EXPECT_THAT(with_wheels(array + "20000 rpm}", ""), IsEmpty());
  EXPECT_THAT(with_wheels(array + "8000}", ""),
              ElementsAre(HasSubstr("robot.wheel_array.rate is 8000 rad/s, 76394.4 turns per minute, faster than any "
                                    "wheel or rotor; rates are in rad/s, 8000 rpm would be 837.758041")));
  const auto gyros = [&](const std::string& spin, const std::string& rate) {
    return with_wheels("gyro_array: {configuration: pyramid, inertia: 0.02, spin_rate: " + spin +
                           ", gimbal_inertia: 0.02, rate: " + rate + "}",
                       "");
  };
  EXPECT_THAT(gyros("628", "2"), IsEmpty());
  EXPECT_THAT(gyros("9000", "2"), ElementsAre(HasSubstr("robot.gyro_array.spin_rate is 9000 rad/s")));
  EXPECT_THAT(gyros("628", "60"), ElementsAre(HasSubstr("60 deg/s would be 1.04719755")));
}

TEST(Warnings, JointLimitsInDegrees) {
  const auto with_limits = [](const std::string& limits) {
    return warnings_with({{"{name: elbow, type: revolute", "{name: elbow, type: revolute, limits: " + limits}});
  };
  EXPECT_THAT(
      with_limits("{lower: -143, upper: 143}"),
      ElementsAre(HasSubstr("joint.limits.lower is -143 rad, 22.8 turns; limits are in rad, -143 degrees would be "
                            "-2.4958"),
                  HasSubstr("joint.limits.upper is 143 rad")));
  EXPECT_THAT(with_limits("{lower: -90, upper: 170}"), testing::SizeIs(2));
  EXPECT_THAT(
      with_limits("{rate: 30}"),
      ElementsAre(HasSubstr("joint.limits.rate is 30 rad/s, 4.77 turns per second; rates are in rad/s, 30 deg/s "
                            "would be 0.523598776")));
  // Joints of several turns, units, infinity, fast joints.
  for (const char* meant :
       {"{lower: -2.9, upper: 2.9}", "{lower: -6.283185307, upper: 6.283185307}", "{lower: -12.566, upper: 12.566}",
        "{lower: -174.5329, upper: 174.5329}", "{lower: -143 deg, upper: 143 deg}", "{lower: -1000, upper: 1000}",
        "{lower: -.inf, upper: .inf}", "{rate: 10}", "{rate: 90 deg/s}"})
    EXPECT_THAT(with_limits(meant), IsEmpty()) << meant;
}

TEST(Warnings, InertiaAboutTheJoint) {
  // The upper link is 5 kg and 1 m long, from the shoulder to the elbow.
  const auto link = [](const std::string& com, const std::string& inertia, const std::string& more = "") {
    return warnings_with(
        {{"com: [0.5, 0, 0]\n      inertia: [0.1, 0.5, 0.5]", "com: " + com + "\n      inertia: " + inertia + more}});
  };
  const auto doubtful = ElementsAre(HasSubstr("is it about the origin?"));
  // A rod with 5/12 kg m^2 about its centre and 5/3 about its end; a rod with heavy ends; a thick rod.
  EXPECT_THAT(link("[0.5, 0, 0]", "[0.01, 0.416, 0.416]"), IsEmpty());
  EXPECT_THAT(
      link("[0.5, 0, 0]", "[0.01, 1.666, 1.666]"),
      ElementsAre("scenario.yaml:11:16: warning: robot.links[0].inertia: with the mass 5 kg and the centre of mass "
                  "0.5 m from the frame's origin it gives a mass distribution of 0.576 m (root mean square) along the "
                  "line between them, but the body ends 0.5 m from the centre of mass; is it about the origin? "
                  "About the centre of mass, as required, it would be [0.01, 0.416, 0.416, 0, 0, 0]"));
  EXPECT_THAT(link("[0.5, 0, 0]", "[0.01, 1.25, 1.25]"), IsEmpty());
  EXPECT_THAT(link("[0.5, 0, 0]", "[0.1, 2.4, 2.4]"), doubtful);
  EXPECT_THAT(link("[0.5, 0, 0]", "[1, 0.9, 0.9]"), IsEmpty());
  // A housing wider than the joint distance, with the centre of mass near its joint.
  EXPECT_THAT(link("[0.02, 0, 0]", "[0.1, 0.1, 0.12]"), IsEmpty());
  // A planar model with one number for all axes.
  EXPECT_THAT(link("[0.5, 0, 0]", "[1.3, 1.3, 1.3]"), IsEmpty());
  // A published arm: 30 kg, joints 0.275 m apart, a wider housing, and a shape smaller than the housing.
  EXPECT_THAT(
      warnings_with({{"mass: 5\n      com: [0.5, 0, 0]\n      inertia: [0.1, 0.5, 0.5]",
                      "mass: 30\n      com: [0.1375, 0, 0]\n      inertia: [1.378, 2.1, 2.359]\n      geometry: "
                      "{shape: capsule, radius: 0.06, length: 0.275, position: [0.1375, 0, 0], rpy: [0, 1.5708, 0]}"},
                     {"origin: {position: [1, 0, 0]}", "origin: {position: [0.275, 0, 0]}"}}),
      IsEmpty());
  // A shape longer than the joint distance.
  EXPECT_THAT(link("[0.5, 0, 0]", "[0.01, 1.666, 1.666]",
                   "\n      geometry: {shape: box, size: [2, 0.05, 0.05], position: [0.5, 0, 0]}"),
              IsEmpty());
  // A line that is not parallel to an axis.
  EXPECT_THAT(link("[0.4, 0.3, 0]", "[0.605, 1.075, 1.67, -0.78, 0, 0]"), doubtful);
  // For targets and bases the check uses only the shapes.
  const auto target = [](const std::string& more) {
    return warnings_with(
        {of_ball("10", "[0.1, 3.4, 3.4]"), {"    grasp_points", "    com: [0.5, 0, 0]\n" + more + "    grasp_points"}});
  };
  EXPECT_THAT(target(""), IsEmpty());
  EXPECT_THAT(target("    geometry: {shape: box, size: [1, 0.1, 0.1], position: [0.5, 0, 0]}\n"), doubtful);
}

TEST(Warnings, QuaternionsInAnotherOrder) {
  const auto turned = [](const std::string& q) {
    return warnings_with({{"position: [2, 0, 0],", "position: [2, 0, 0], quaternion_wxyz: " + q + ","}});
  };
  EXPECT_THAT(
      turned("[0, 0, 0, 1]"),
      ElementsAre("scenario.yaml:25:51: warning: targets[0].state.quaternion_wxyz rotates by 180 degrees; in the order "
                  "x, y, z, w it would rotate by 0. The order is w, x, y, z; use rpy for an intended half turn"));
  EXPECT_THAT(turned("[0.06, -0.08, 0, 0.994987437106620]"), ElementsAre(HasSubstr("it would rotate by 11.48")));
  EXPECT_THAT(turned("[1, 0, 0, 0]"), IsEmpty());
  EXPECT_THAT(turned("[0, 1, 0, 0]"), IsEmpty());
  EXPECT_THAT(turned("[0.70710678118654752, 0, 0, 0.70710678118654752]"), IsEmpty());
  EXPECT_THAT(turned("[6.123233995736766e-17, 0, 0, 1]"), IsEmpty());  // a half turn computed by a program
}

// Models state orientations by roll, pitch and yaw, or by a quaternion whose order their format fixes.
TEST(Warnings, NoneForHalfTurnsOfModels) {
  const TemporaryFolder folder;
  const auto model = [&](const std::string& origin) {
    return folder.write(
        "arm.urdf",
        "<robot name='q'><link name='bus'><inertial><mass value='100'/>"
        "<inertia ixx='10' iyy='10' izz='10' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<link name='arm'><inertial><mass value='1'/>"
        "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        "<joint name='j' type='revolute'><parent link='bus'/><child link='arm'/><origin xyz='0 0 0' " +
            origin + "/><axis xyz='1 0 0'/><limit lower='-2' upper='2' effort='10' velocity='100'/></joint></robot>");
  };
  for (const char* rpy : {"0 0 3.14", "0 0 3.141592653589793", "0 0 -3.14159", "0.1 -0.05 3.1", "3.14 3.14 0"}) {
    std::vector<Fault> warnings;
    const RobotSetup robot = load_robot(model(std::string("rpy='") + rpy + "'"), &warnings);
    for (const Fault& doubt : warnings) ADD_FAILURE() << rpy << ": " << doubt.text();
    ASSERT_EQ(robot.bodies.size(), 2u);
  }
  // The same rotation as in the file.
  const RobotSetup robot = load_robot(model("rpy='0.1 -0.05 3.1'"));
  const Rotationd R = rotation_from_rpy(0.1, -0.05, 3.1);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(robot.bodies[1].X_PF.R(i, j), R(i, j), 1e-15);  // measured 2.3e-16
  }
}

TEST(Warnings, GraspPoints) {
  const Edit ball = with_shape("{shape: sphere, radius: 0.5}");
  EXPECT_THAT(
      warnings_with({ball, {"{name: grip, position: [0, 0.5, 0]}", "{name: grip, position: [2, 0.5, 0]}"}}),
      ElementsAre("scenario.yaml:28:32: warning: targets[0].grasp_points[0].position is 2.062 m from the target's "
                  "origin, and its shape ends at 0.5 m; positions of grasp points are in the target's frame, in m"));
  EXPECT_THAT(
      warnings_with({with_tip("approach_axis: [1, 0, 0]"), with_point("approach_direction: [0, 1, 0]")}),
      ElementsAre(
          "scenario.yaml:27:65: warning: targets[0].grasp_points[0].approach_direction points away from the target: it "
          "must be the direction of motion of the approaching end-effector; did you mean [0, -1, 0]?"));
  EXPECT_THAT(warnings_with({with_tip("approach_axis: [1, 0, 0]"), with_point("approach_direction: [0, -1, 0]")}),
              IsEmpty());
  EXPECT_THAT(warnings_with({with_point("normal: [0, -1, 0]")}),
              ElementsAre(HasSubstr("normal points into the target")));
  EXPECT_THAT(warnings_with({with_tip("approach_axis: [-1, 0, 0]")}),
              ElementsAre("scenario.yaml:18:68: warning: robot.end_effectors[0].approach_axis points from the "
                          "end-effector back to the origin of its link 'lower': it must be the direction of approach"));
}

const Edit kSecondEffector{"    - {name: tip, link: lower, position: [1, 0, 0]}",
                           "    - {name: tip, link: lower, position: [1, 0, 0]}\n    - {name: hand, link: upper}"};
const Edit kSecondGrasp{"  - {end_effector: tip, target: ball, point: grip}",
                        "  - {end_effector: tip, target: ball, point: grip}\n"
                        "  - {end_effector: hand, target: ball, point: grip}"};

TEST(Warnings, TwoEndEffectorsAtOneGraspPoint) {
  EXPECT_THAT(
      warnings_with({kSecondEffector, kSecondGrasp}),
      ElementsAre("scenario.yaml:31:47: warning: grasps[1]: end-effectors 'tip' and 'hand' have the same grasp point "
                  "on target 'ball' and would collide"));
  // The second end-effector takes over from the first.
  EXPECT_THAT(warnings_with({kSecondEffector,
                             {"  - {end_effector: tip, target: ball, point: grip}",
                              "  - {end_effector: tip, target: ball, point: grip}\n"
                              "  - {end_effector: hand, target: ball, point: grip, closes_at: 25}"},
                             with_post_impact("release: [{after: 4, end_effectors: [tip]}]")}),
              IsEmpty());
}

TEST(Warnings, BodiesThatOverlapAtTheStart) {
  const Edit base{"base: {mass: 100, inertia: [10, 10, 10]}",
                  "base: {mass: 100, inertia: [10, 10, 10], geometry: {shape: box, size: [1, 1, 1]}}"};
  const auto at = [&](const std::string& x) {
    return warnings_with({base, with_shape("{shape: sphere, radius: 0.5}"), {"position: [2, 0, 0]", "position: " + x}});
  };
  EXPECT_THAT(at("[0.9, 0, 0]"),
              ElementsAre("scenario.yaml:25:23: warning: 'base' and target 'ball' overlap by 0.1 m at t "
                          "= 0, by their shapes"));
  EXPECT_THAT(at("[1.1, 0, 0]"), IsEmpty());
  // A pair of bodies is reported once, with its deepest overlap.
  EXPECT_THAT(warnings_with({base,
                             with_shape("[{shape: sphere, radius: 0.5}, {shape: sphere, radius: 0.7}]"),
                             {"position: [2, 0, 0]", "position: [0.9, 0, 0]"}}),
              ElementsAre(HasSubstr("'base' and target 'ball' overlap by 0.3 m at t = 0")));
  // Also without monitoring, but not if contact is allowed.
  const std::vector<Edit> there{
      base, with_shape("{shape: sphere, radius: 0.5}"), {"position: [2, 0, 0]", "position: [0.9, 0, 0]"}};
  std::vector<Edit> unwatched = there, allowed = there;
  unwatched.push_back(with_top("clearance: {enabled: false}"));
  allowed.push_back(with_top("clearance: {ignore: [[base, ball]]}"));
  EXPECT_THAT(warnings_with(unwatched), testing::SizeIs(1));
  EXPECT_THAT(warnings_with(allowed), IsEmpty());
  // The initial state follows from the capture: the ball starts at x = 2.9.
  EXPECT_THAT(warnings_with({base,
                             with_shape("{shape: sphere, radius: 0.5}"),
                             {"position: [2, 0, 0], angular_velocity",
                              "position: [0.9, 0, 0], velocity: [-0.1, 0, 0], angular_velocity"}}),
              IsEmpty());
}

// Clearance does not watch pairs that may touch, but they must be apart at the start.
TEST(Warnings, BodiesThatMayTouchAndOverlapAtTheStart) {
  const std::vector<Edit> there{{"base: {mass: 100, inertia: [10, 10, 10]}",
                                 "base: {mass: 100, inertia: [10, 10, 10], geometry: {shape: box, size: [1, 1, 1]}}"},
                                with_shape("{shape: sphere, radius: 0.5}"),
                                {"position: [2, 0, 0]", "position: [0.9, 0, 0]"},
                                with_top("materials: [{name: pad, stiffness: 1e4}]\n"
                                         "contacts: {pairs: [[base, ball]], material: pad}")};
  EXPECT_THAT(warnings_with(there),
              ElementsAre(HasSubstr("'base' and target 'ball' overlap by 0.1 m at t = 0, by their shapes; 'contacts' "
                                    "lets them touch, so that the run will fail: move one of them")));
}

TEST(Warnings, ContactsThatNeedTooManySteps) {
  const auto with = [](const std::string& stiffness, const std::string& integration) {
    return warnings_with({{"base: {mass: 100, inertia: [10, 10, 10]}",
                           "base: {mass: 100, inertia: [10, 10, 10], geometry: {shape: box, size: [1, 1, 1]}}"},
                          with_shape("{shape: sphere, radius: 0.5}"),
                          with_top("integration: {" + integration + "}\nmaterials: [{name: pad, stiffness: " +
                                   stiffness + "}]\ncontacts: {pairs: [[base, ball]], material: pad}")});
  };
  EXPECT_THAT(with("1e11", "method: adaptive_8, max_steps: 100000"),
              ElementsAre(AllOf(HasSubstr("contact of 'base' and 'ball' with 1e+11 N/m vibrates with"),
                                HasSubstr("integration.max_steps is 1e+05; use a stiffness of at most"))));
  EXPECT_THAT(with("1e4", "method: adaptive_8, max_steps: 100000"), IsEmpty());
  EXPECT_THAT(with("1e11", "method: rk4"), IsEmpty());
}

TEST(Warnings, OfOverridesNameThem) {
  EXPECT_THAT(warnings_of(kSmallScenario, {{"initial.joints.elbow", "90"}}),
              ElementsAre(HasSubstr("--set initial.joints.elbow=90: warning: initial.joints.elbow is 90 rad")));
}

}  // namespace plausibility_test
}  // namespace grapnel::test
