// Every kind of error in a robot, inline in a scenario and in separate files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace robot_faults_test {

class RobotFault : public testing::TestWithParam<FaultCase> {};

// The texts are the interface: they name the place, the value, what is allowed and what may have been meant.
TEST_P(RobotFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

const std::vector<FaultCase> kCases{
    {"robot_of_wrong_type",
     {{"robot:\n  name: arm\n  base: {mass: 100, inertia: [10, 10, 10]}", "robot: [1]\nx:"}},
     {"scenario.yaml:2:8: error: robot must be the name of a ready-made robot, the path of a robot file or model, a "
      "mapping "
      "with a robot's content or a mapping with a bus and arms, not a list",
      "scenario.yaml:3:1: error: unknown key 'x' in the scenario; allowed are schema, name, description, robot, "
      "import, gravity, orbit, initial, targets, grasps, approach, contact, impact, post_impact, motion, "
      "external_wrenches, "
      "control, sensors, impedance, clearance, …"}},
    {"robot_axis_not_unit",
     {{"type: revolute, axis: [0, 0, 1], limits", "type: revolute, axis: [0, 1, 1], limits"}},
     {"scenario.yaml:8:53: error: robot.links[0].joint.axis has length 1.41421356, must be a unit vector; normalised "
      "it is [0, 0.7071067811865475, 0.7071067811865475]"}},
    {"robot_axis_zero",
     {{"type: revolute, axis: [0, 0, 1], limits", "type: revolute, axis: [0, 0, 0], limits"}},
     {"scenario.yaml:8:53: error: robot.links[0].joint.axis has length 0, must be a unit vector"}},
    {"robot_axis_missing",
     {{"type: revolute, axis: [0, 0, 1], limits", "type: revolute, limits"}},
     {"scenario.yaml:8:14: error: missing key 'axis' in robot.links[0].joint, needed with type: revolute"}},
    {"robot_inertia",
     {{"base: {mass: 100, inertia: [10, 10, 10]}", "base: {mass: 100, inertia: [10, 10, 30]}"}},
     {"scenario.yaml:4:30: error: robot.base: inertia breaks the triangle inequality: principal moment 30 is larger "
      "than the sum of 10 and 10, which no body has"}},
    {"robot_mass",
     {{"base: {mass: 100, inertia: [10, 10, 10]}", "base: {mass: 0, inertia: [10, 10, 10]}"}},
     {"scenario.yaml:4:16: error: robot.base.mass is 0, must be greater than 0 [kg]"}},
    {"robot_duplicate_link",
     {{"name: lower", "name: upper"}},
     {"scenario.yaml:12:13: error: duplicate name 'upper' in robot.links[1]: link names must differ; first given in "
      "line 6"}},
    {"robot_duplicate_joint",
     {{"name: elbow", "name: shoulder"}},
     {"scenario.yaml:14:21: error: duplicate name 'shoulder' in robot.links[1].joint: joint names must differ; first "
      "given in line 8"}},
    {"robot_duplicate_end_effector",
     {{"    - {name: tip,", "    - {name: tip, link: base}\n    - {name: tip,"}},
     {"scenario.yaml:19:14: error: duplicate name 'tip' in robot.end_effectors[1]: end-effector names must differ; "
      "first given in line 18"}},
    {"robot_link_named_as_the_base",
     {{"name: upper", "name: base"}},
     {"scenario.yaml:6:13: error: duplicate name 'base' in robot.links[0]: link names must differ; first given in line "
      "4"}},
    {"robot_unknown_parent",
     {{"parent: upper", "parent: uper"}},
     {"scenario.yaml:13:15: error: unknown link 'uper' in robot.links[1]; did you mean 'upper'?"}},
    {"robot_unknown_link",
     {{"link: lower", "link: lowr"}},
     {"scenario.yaml:18:25: error: unknown link 'lowr' in robot.end_effectors[0]; did you mean 'lower'?"}},
    {"robot_cycle",
     {{"parent: base", "parent: lower"}},
     {"scenario.yaml:7:15: error: robot.links[0]: the parents of 'upper' form a cycle: upper -> lower -> upper",
      "scenario.yaml:13:15: error: robot.links[1]: the parents of 'lower' form a cycle: lower -> upper -> lower"}},
    {"robot_own_parent",
     {{"parent: base", "parent: upper"}},
     {"scenario.yaml:7:15: error: robot.links[0]: the parents of 'upper' form a cycle: upper -> upper"}},
    {"robot_limits",
     {{"lower: -2, upper: 2", "lower: 2, upper: -2"}},
     {"scenario.yaml:8:80: error: robot.links[0].joint.limits: lower limit 2 is above upper limit -2"}},
    {"robot_stop_without_limits",
     {{"lower: -2, upper: 2", "stop: {restitution: 0.5}"}},
     {"scenario.yaml:8:79: error: robot.links[0].joint.limits.stop: there is neither a lower nor an upper limit"}},
    {"robot_stop_that_throws_harder",
     {{"lower: -2, upper: 2", "lower: -2, upper: 2, stop: {restitution: 1.5}"}},
     {"scenario.yaml:8:114: error: robot.links[0].joint.limits.stop.restitution is 1.5, must be between 0 and 1"}},
    {"robot_static_less_than_coulomb",
     {{"origin:", "friction: {model: sticking, coulomb: 2, static: 1}, origin:"}},
     {"scenario.yaml:14:109: error: robot.links[1].joint.friction.static: 1 is less than coulomb, 2"}},
    {"robot_static_of_smooth",
     {{"origin:", "friction: {model: smooth, coulomb: 2, static: 3}, origin:"}},
     {"scenario.yaml:14:99: error: 'static' in robot.links[1].joint.friction has no meaning with model: smooth"}},
    {"robot_rotor_axis_without_rotor",
     {{"origin:", "rotor_axis: [0, 0, 1], origin:"}},
     {"scenario.yaml:14:61: error: 'rotor_axis' needs 'rotor_inertia' in robot.links[1].joint"}},
    {"robot_resistance_without_constant",
     {{"origin:", "motor: {resistance: 1}, origin:"}},
     {"scenario.yaml:14:69: error: 'resistance' needs 'torque_constant' in robot.links[1].joint.motor"}},
    {"robot_limit_nan",
     {{"lower: -2, upper: 2", "lower: .nan, upper: 2"}},
     {"scenario.yaml:8:80: error: robot.links[0].joint.limits.lower is .nan, must be a number [rad or m]"}},
    {"robot_limits_of_continuous",
     {{"type: revolute, axis: [0, 0, 1], limits", "type: continuous, axis: [0, 0, 1], limits"}},
     {"scenario.yaml:8:75: error: 'lower' in robot.links[0].joint.limits has no meaning with type: continuous",
      "scenario.yaml:8:86: error: 'upper' in robot.links[0].joint.limits has no meaning with type: continuous"}},
    {"robot_axis_of_fixed",
     {{"type: revolute, axis: [0, 0, 1], origin", "type: fixed, axis: [0, 0, 1], origin"}, {"elbow: 1", "elbow: 2"}},
     {"scenario.yaml:14:41: error: 'axis' in robot.links[1].joint has no meaning with type: fixed",
      "scenario.yaml:20:27: error: joint 'elbow' in initial.joints is fixed and has no value",
      "scenario.yaml:32:17: error: approach.final_joints has 2 items, must have 1, one for each moving joint: "
      "shoulder"}},
    {"robot_rate_limit",
     {{"rate: 1", "rate: 0"}},
     {"scenario.yaml:8:100: error: robot.links[0].joint.limits.rate is 0, must be greater than 0 [rad/s or m/s]"}},
    {"robot_moving_fixed_base",
     {{"base: {mass: 100,", "base: {mode: fixed, mass: 100,"},
      {"initial:\n", "initial:\n  base: {velocity: [1, 0, 0]}\n"}},
     {"scenario.yaml:20:10: error: initial.base.velocity: the robot's base is fixed, so its motion cannot be stated"}},
    {"robot_missing_base",
     {{"  base: {mass: 100, inertia: [10, 10, 10]}\n", ""}},
     {"scenario.yaml:3:3: error: missing key 'base' in robot"}},
    {"robot_joint_type",
     {{"type: revolute, axis: [0, 0, 1], limits", "type: revolut, axis: [0, 0, 1], limits"}},
     {"scenario.yaml:8:37: error: unknown value 'revolut' for robot.links[0].joint.type; did you mean 'revolute'?"}},
};

INSTANTIATE_TEST_SUITE_P(Each, RobotFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(RobotFaults, InAnIncludedFileNameThatFile) {
  const TemporaryFolder folder;
  folder.write("arm.yaml", edited(small_robot(), {{"mass: 100", "mass: 0"}}));
  const std::string text =
      edited(kSmallScenario, {{"robot:\n  name: arm\n", "robot: arm.yaml\nunused:\n  name: arm\n"}});
  const auto faults = faults_of_file(folder.write("scenario.yaml", text));
  ASSERT_EQ(faults.size(), 2u);
  EXPECT_EQ(faults[0], "arm.yaml:2:14: error: base.mass is 0, must be greater than 0 [kg]");
  EXPECT_THAT(faults[1],
              testing::StartsWith("scenario.yaml:3:1: error: unknown key 'unused' in the scenario; allowed are "));
}

TEST(RobotFaults, RobotFileAlone) {
  EXPECT_THAT(robot_faults_of(small_robot()), testing::IsEmpty());
  EXPECT_EQ(robot_faults_of(edited(small_robot(), {{"link: lower", "link: lowr"}, {"name: arm", "nam: arm"}})),
            (std::vector<std::string>{
                "robot.yaml:1:1: error: unknown key 'nam' in the robot; did you mean 'name'?",
                "robot.yaml:16:23: error: unknown link 'lowr' in end_effectors[0]; did you mean 'lower'?"}));
}

TEST(RobotFaults, UnreadableRobotDoesNotHideTheRest) {
  const std::string text = edited(kSmallScenario, {{"robot:\n  name: arm\n", "robot: arm.yml\nunused:\n  name: arm\n"},
                                                   {"duration: 20", "duration: -1"}});
  const TemporaryFolder folder;
  folder.write("arm.yaml", "name: other");
  const auto faults = faults_of_file(folder.write("scenario.yaml", text));
  ASSERT_EQ(faults.size(), 3u);
  EXPECT_EQ(faults[0],
            "scenario.yaml:2:8: error: cannot read the file 'arm.yml': no such file; did you mean 'arm.yaml'?");
  // Unknown joints and end-effectors are not reported for a robot that was not read.
  EXPECT_EQ(faults[2], "scenario.yaml:32:13: error: approach.duration is -1, must be greater than 0 [s]");
}

TEST(RobotFaults, AHangerOnACycleIsNotAtFault) {
  const std::string extra =
      "    - {name: third, parent: lower, joint: {name: wrist, type: fixed}, mass: 1, inertia: [1, 1, 1]}\n";
  const auto faults = faults_of(edited(
      kSmallScenario, {{"parent: base", "parent: lower"}, {"  end_effectors:\n", extra + "  end_effectors:\n"}}));
  EXPECT_EQ(
      faults,
      (std::vector<std::string>{
          "scenario.yaml:7:15: error: robot.links[0]: the parents of 'upper' form a cycle: upper -> lower -> upper",
          "scenario.yaml:13:15: error: robot.links[1]: the parents of 'lower' form a cycle: lower -> upper -> lower"}));
}

TEST(RobotFaults, LargeRobotsAreCheckedQuickly) {
  SKIP_UNDER_SANITIZERS();
  // A chain given from its end, and the same closed to a ring.
  const auto chain = [](int count, const std::string& first_parent) {
    std::string text = "base: {mass: 1, inertia: [1, 1, 1]}\nlinks:\n";
    for (int i = count; i-- > 0;) {
      const std::string n = std::to_string(i);
      text += "  - {name: l" + n + ", parent: " + (i == 0 ? first_parent : "l" + std::to_string(i - 1)) +
              ", joint: {name: j" + n + ", type: revolute, axis: [0, 0, 1]}, mass: 1, inertia: [1, 1, 1]}\n";
    }
    return text;
  };
  EXPECT_THAT(robot_faults_of(chain(1000, "base")), testing::IsEmpty());
  EXPECT_EQ(robot_faults_of(chain(1000, "l999")).size(), 1000u);
  EXPECT_THAT(robot_faults_of(chain(4001, "base")),
              testing::ElementsAre("robot.yaml:3:3: error: links has 4001 items, must have at most 4000"));
}

TEST(RobotFaults, SuggestedAxisIsAccepted) {
  const auto faults = faults_of(edited(kSmallScenario, {{"axis: [0, 0, 1], limits", "axis: [1, 2, 3], limits"}}));
  ASSERT_EQ(faults.size(), 1u);
  const std::size_t at = faults[0].find("normalised it is ");
  ASSERT_NE(at, std::string::npos);
  const std::string axis = faults[0].substr(at + std::string("normalised it is ").size());
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"axis: [0, 0, 1], limits", "axis: " + axis + ", limits"}})),
              testing::IsEmpty());
}

}  // namespace robot_faults_test
}  // namespace grapnel::test
