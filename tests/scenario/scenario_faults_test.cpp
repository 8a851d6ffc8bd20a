// Input errors in a scenario, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace scenario_faults_test {

class ScenarioFault : public testing::TestWithParam<FaultCase> {};

// Messages are part of the interface: they state the location, the value, the allowed values and a suggestion.
TEST_P(ScenarioFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

const std::vector<FaultCase> kCases{
    {"unknown_key",
     {{"impact: {duration: 1e-3}", "impact: {duration: 1e-3, restitutoin: 0}"}},
     {"scenario.yaml:34:26: error: unknown key 'restitutoin' in impact; did you mean 'restitution'?"}},
    {"unknown_key_at_top",
     {{"name: test", "name: test\ngravty: [0, 0, 0]"}},
     {"scenario.yaml:2:1: error: unknown key 'gravty' in the scenario; did you mean 'gravity'?"}},
    {"unknown_key_without_likeness",
     {{"post_impact: {duration: 10}", "post_impact: {duration: 10, colour: red}"}},
     {"scenario.yaml:35:29: error: unknown key 'colour' in post_impact; allowed are name, duration, until, joints, "
      "kp, kd, move, tendons, detumble, keep_base_attitude, grasp_force, base_control, at_rest, assumed, identify, "
      "model, "
      "release"}},
    {"duplicate_key",
     {{"  duration: 20", "  duration: 20\n  duration: 30"}},
     {"scenario.yaml:32:3: error: duplicate key 'duration' in approach; first given in line 31"}},
    {"duplicate_key_at_top",
     {{"name: test", "name: test\nname: again"}},
     {"scenario.yaml:2:1: error: duplicate key 'name' in the scenario; first given in line 1"}},
    {"duplicate_key_below_unknown",
     {{"name: test", "name: test\nextra: {a: 1, a: 2}"}},
     {"scenario.yaml:2:1: error: unknown key 'extra' in the scenario; allowed are schema, name, description, robot, "
      "import, gravity, orbit, initial, targets, grasps, approach, contact, impact, post_impact, motion, "
      "external_wrenches, "
      "control, sensors, impedance, clearance, …",
      "scenario.yaml:2:15: error: duplicate key 'a' in extra; first given in line 2"}},
    {"wrong_type_text",
     {{"duration: 20", "duration: long"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s], not the text 'long'"}},
    {"wrong_type_list",
     {{"duration: 20", "duration: [20]"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s], not a list"}},
    {"wrong_type_mapping",
     {{"duration: 20", "duration: {value: 20}"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s], not a mapping"}},
    {"wrong_type_empty",
     {{"duration: 20", "duration:"}},
     {"scenario.yaml:31:3: error: approach.duration is empty, must be a number [s]"}},
    {"wrong_type_unit",
     {{"duration: 20", "duration: 20 m"}},
     {"scenario.yaml:31:13: error: approach.duration is '20 m', a length; expected a time [s, ms, min, h]"}},
    {"wrong_type_name",
     {{"name: test", "name: 12"}},
     {"scenario.yaml:1:7: error: name must be text, not the number 12; put it in quotes: '12'"}},
    {"wrong_type_name_bool",
     {{"name: test", "name: true"}},
     {"scenario.yaml:1:7: error: name must be text, not true; put it in quotes: 'true'"}},
    {"empty_name", {{"name: test", "name: \"\""}}, {"scenario.yaml:1:7: error: name must not be empty"}},
    {"list_instead_of_mapping",
     {{"impact: {duration: 1e-3}", "impact: [1e-3]"}},
     {"scenario.yaml:34:9: error: impact must be a mapping, not a list"}},
    {"mapping_instead_of_list",
     {{"targets:\n  - name: ball", "targets:\n    name: ball"}},
     {"scenario.yaml:22:5: error: targets must be a list, not a mapping"}},
    {"number_instead_of_alternatives",
     {{"joints: {shoulder: 0.5, elbow: 1}", "joints: 0.5"}},
     {"scenario.yaml:20:11: error: initial.joints must be a mapping {joint name: value} or a list in joint order [rad "
      "or m], not the number 0.5"}},
    {"text_instead_of_gain",
     {{"  final_rates", "  tracking: {mode: pd, kp: high, kd: 14}\n  final_rates"}},
     {"scenario.yaml:33:28: error: approach.tracking.kp must be a number for all joints, a mapping {joint name: value} "
      "or a list in joint order [N m/rad or N/m; for computed_torque 1/s^2], not the text 'high'"}},
    {"missing_key", {{"    mass: 10\n", ""}}, {"scenario.yaml:22:5: error: missing key 'mass' in targets[0]"}},
    {"missing_two_keys",
     {{"impact: {duration: 1e-3}\npost_impact: {duration: 10}", "impact: {}\npost_impact: {}"}},
     {"scenario.yaml:35:14: error: missing key 'duration' in post_impact"}},
    {"missing_initial_joints",
     {{"joints: {shoulder: 0.5, elbow: 1}", "base: {}"}},
     {"scenario.yaml:20:3: error: missing key 'joints' in initial: every moving joint needs a value"}},
    {"missing_joint_in_mapping",
     {{"{shoulder: 0.5, elbow: 1}", "{shoulder: 0.5}"}},
     {"scenario.yaml:20:11: error: initial.joints lacks joints: elbow"}},
    {"not_a_number",
     {{"duration: 20", "duration: .nan"}},
     {"scenario.yaml:31:13: error: approach.duration is .nan, must be a finite number [s]"}},
    {"infinite",
     {{"duration: 20", "duration: .inf"}},
     {"scenario.yaml:31:13: error: approach.duration is .inf, must be a finite number [s]"}},
    {"infinite_in_vector",
     {{"[2, 0, 0]", "[-.inf, 0, 0]"}},
     {"scenario.yaml:25:24: error: targets[0].state.position[0] is -.inf, must be a finite number [m]"}},
    {"infinite_mass",
     {{"mass: 10\n", "mass: .inf\n"}},
     {"scenario.yaml:23:11: error: targets[0].mass is .inf, must be a finite number [kg]"}},
    {"too_large_for_a_double",
     {{"duration: 20", "duration: 1e999"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; '1e999' is above the range of a double"}},
    {"octal",
     {{"duration: 20", "duration: 020"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; '020' looks octal, write 20"}},
    {"octal_with_sign",
     {{"[0.2, -0.4]", "[0.2, -010]"}},
     {"scenario.yaml:32:23: error: approach.final_joints[1] must be a number [rad or m]; '-010' looks octal, write "
      "-10"}},
    {"octal_yaml_1_2",
     {{"duration: 20", "duration: 0o24"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; '0o24' is not accepted, write the decimal "
      "number 20"}},
    {"hexadecimal",
     {{"duration: 20", "duration: 0x14"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; '0x14' is not accepted, write the decimal "
      "number 20"}},
    {"binary",
     {{"duration: 20", "duration: 0b10100"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; '0b10100' is not accepted, write the "
      "decimal number 20"}},
    {"underscore",
     {{"duration: 20", "duration: 1_000"}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s], not the text '1_000'; digits are not "
      "grouped, "
      "write 1000"}},
    {"quoted_number",
     {{"duration: 20", "duration: \"20\""}},
     {"scenario.yaml:31:13: error: approach.duration must be a number [s]; remove the quotes around '20'"}},
    {"short_vector",
     {{"[2, 0, 0]", "[2, 0]"}},
     {"scenario.yaml:25:23: error: targets[0].state.position has 2 items, must have exactly 3"}},
    {"long_vector",
     {{"[2, 0, 0]", "[2, 0, 0, 0]"}},
     {"scenario.yaml:25:23: error: targets[0].state.position has 4 items, must have exactly 3"}},
    {"inertia_length",
     {{"inertia: [1, 1, 1]", "inertia: [1, 1, 1, 0]"}},
     {"scenario.yaml:24:14: error: targets[0].inertia has 4 items, must be [Ixx, Iyy, Izz], [Ixx, Iyy, Izz, Ixy, Ixz, "
      "Iyz], a symmetric 3 x 3 matrix or a mapping {xx, yy, zz, xy, xz, yz} [kg m^2]"}},
    {"list_of_joints_too_short",
     {{"[0.2, -0.4]", "[0.2]"}},
     {"scenario.yaml:32:17: error: approach.final_joints has 1 item, must have 2, one for each moving joint: shoulder, "
      "elbow"}},
    {"quaternion_not_unit",
     {{"state: {", "state: {quaternion_wxyz: [1, 0, 1, 0], "}},
     {"scenario.yaml:25:30: error: targets[0].state.quaternion_wxyz has length 1.41421356, must be 1 within 1e-6; "
      "normalised it is [0.707106781, 0, 0.707106781, 0]"}},
    {"quaternion_zero",
     {{"state: {", "state: {quaternion_wxyz: [0, 0, 0, 0], "}},
     {"scenario.yaml:25:30: error: targets[0].state.quaternion_wxyz has length 0, must be 1 within 1e-6"}},
    {"two_orientations",
     {{"state: {", "state: {rpy: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0], "}},
     {"scenario.yaml:25:29: error: targets[0].state has both 'quaternion_wxyz' and 'rpy', only one is allowed"}},
    {"momentum_and_velocity",
     {{"initial:", "initial:\n  base: {velocity: [0, 0, 0], momentum: {linear: [1, 0, 0]}}"}},
     {"scenario.yaml:20:31: error: initial.base has both 'momentum' and 'velocity', only one is allowed"}},
    {"mass_zero",
     {{"mass: 10\n", "mass: 0\n"}},
     {"scenario.yaml:23:11: error: targets[0].mass is 0, must be greater than 0 [kg]"}},
    {"mass_negative",
     {{"mass: 10\n", "mass: -10\n"}},
     {"scenario.yaml:23:11: error: targets[0].mass is -10, must be greater than 0 [kg]"}},
    {"inertia_not_positive",
     {{"inertia: [1, 1, 1]", "inertia: [1, 1, -1]"}},
     {"scenario.yaml:24:14: error: targets[0]: inertia is not positive definite (principal moments -1, 1, 1)"}},
    {"inertia_triangle",
     {{"inertia: [1, 1, 1]", "inertia: {xx: 1, yy: 1, zz: 2.5}"}},
     {"scenario.yaml:24:14: error: targets[0]: inertia breaks the triangle inequality: principal moment 2.5 is larger "
      "than the sum of 1 and 1, which no body has"}},
    {"unknown_choice",
     {{"  final_joints", "  profile: quartik\n  final_joints"}},
     {"scenario.yaml:32:12: error: unknown value 'quartik' for approach.profile; did you mean 'quartic'?"}},
    {"unknown_choice_without_likeness",
     {{"  final_joints", "  profile: straight\n  final_joints"}},
     {"scenario.yaml:32:12: error: unknown value 'straight' for approach.profile; allowed are quartic, cycloidal, "
      "quintic"}},
    {"choice_of_wrong_type",
     {{"  final_joints", "  profile: [quartic]\n  final_joints"}},
     {"scenario.yaml:32:12: error: approach.profile is a list, must be one of quartic, cycloidal, quintic"}},
    {"number_as_choice",
     {{"  final_joints", "  profile: 4\n  final_joints"}},
     {"scenario.yaml:32:12: error: unknown value '4' for approach.profile; allowed are quartic, cycloidal, quintic"}},
    {"wrong_match",
     {{"match: velocity", "match: velocty"}},
     {"scenario.yaml:33:24: error: unknown value 'velocty' for approach.final_rates.match; did you mean 'velocity'?"}},
    {"match_misspelt",
     {{"match: velocity", "matc: twist"}},
     {"scenario.yaml:33:17: error: unknown key 'matc' in approach.final_rates; did you mean 'match'?"}},
    {"wrong_schema",
     {{"name: test", "schema: grapnel-scenario/2\nname: test"}},
     {"scenario.yaml:1:9: error: schema is 'grapnel-scenario/2', must be 'grapnel-scenario/1'"}},
    {"unknown_joint",
     {{"{shoulder: 0.5, elbow: 1}", "{shoulder: 0.5, elbw: 1, elbow: 1}"}},
     {"scenario.yaml:20:27: error: unknown joint 'elbw' in initial.joints; did you mean 'elbow'?"}},
    {"unknown_end_effector",
     {{"end_effector: tip", "end_effector: top"}},
     {"scenario.yaml:29:20: error: unknown end-effector 'top' in grasps[0]; did you mean 'tip'?"}},
    {"unknown_target",
     {{"target: ball", "target: bal"}},
     {"scenario.yaml:29:33: error: unknown target 'bal' in grasps[0]; did you mean 'ball'?"}},
    {"unknown_grasp_point",
     {{"point: grip", "point: handle"}},
     {"scenario.yaml:29:46: error: unknown grasp point 'handle' in grasps[0].point; grasp points are grip"}},
    {"duplicate_target",
     {{"grasps:", "  - {name: ball, mass: 1, inertia: [1, 1, 1], state: {position: [0, 0, 0]}}\ngrasps:"}},
     {"scenario.yaml:28:12: error: duplicate name 'ball' in targets[1]: target names must be unique; first given in "
      "line "
      "22"}},
    {"duplicate_grasp_point",
     {{"      - {name: grip, position: [0, 0.5, 0]}",
       "      - {name: grip, position: [0, 0.5, 0]}\n      - {name: grip}"}},
     {"scenario.yaml:28:16: error: duplicate name 'grip' in targets[0].grasp_points[1]: grasp point names must be "
      "unique; "
      "first given in line 27"}},
    {"end_effector_used_twice",
     {{"point: grip}\n", "point: grip}\n  - {end_effector: tip, target: ball, point: grip}\n"}},
     {"scenario.yaml:30:20: error: end-effector 'tip' in grasps[1] is used twice; first in grasps[0]"}},
    {"target_grasped_by_nobody",
     {{"grasps:", "  - {name: other, mass: 1, inertia: [1, 1, 1], state: {position: [0, 0, 0]}}\ngrasps:"}},
     {"scenario.yaml:28:12: error: no grasp refers to target 'other'; add a grasp or remove the target"}},
    {"duration_zero",
     {{"duration: 20", "duration: 0"}},
     {"scenario.yaml:31:13: error: approach.duration is 0, must be greater than 0 [s]"}},
    {"duration_negative",
     {{"duration: 20", "duration: -1"}},
     {"scenario.yaml:31:13: error: approach.duration is -1, must be greater than 0 [s]"}},
    {"tolerance_too_small",
     {{"\nimpact:", "\nintegration: {relative_tolerance: 1e-15}\nimpact:"}},
     {"scenario.yaml:34:35: error: integration.relative_tolerance is 1e-15, must be between 1e-14 and 0.1"}},
    {"tolerance_too_large",
     {{"\nimpact:", "\nintegration: {absolute_tolerance: 1}\nimpact:"}},
     {"scenario.yaml:34:35: error: integration.absolute_tolerance is 1, must be between 1e-18 and 0.1"}},
    {"steps_not_whole",
     {{"\nimpact:", "\nintegration: {max_steps: 10.5}\nimpact:"}},
     {"scenario.yaml:34:26: error: integration.max_steps must be a whole number, not 10.5"}},
    {"too_many_steps",
     {{"\nimpact:", "\nintegration: {method: rk4, step: 1e-7}\nimpact:"}},
     {"scenario.yaml:34:34: error: integration.step is 1e-07 [s], which gives 2e+08 steps; integration.max_steps "
      "allows 10000000"}},
    {"interval_zero",
     {{"\nimpact:", "\noutput: {interval: 0}\nimpact:"}},
     {"scenario.yaml:34:20: error: output.interval is 0, must be greater than 0 [s]"}},
    {"interval_absurd",
     {{"\nimpact:", "\noutput: {interval: 1e-7}\nimpact:"}},
     {"scenario.yaml:34:20: error: output.interval is 1e-07 [s], which gives 3e+08 samples over 30 s; at most 10000000 "
      "are allowed"}},
    {"final_angle_beyond_limit",
     {{"[0.2, -0.4]", "[2.5, -0.4]"}},
     {"scenario.yaml:32:18: error: approach.final_joints[0] (joint 'shoulder') is 2.5, beyond the joint's limits -2 to "
      "2"}},
    {"initial_angle_beyond_limit",
     {{"shoulder: 0.5", "shoulder: -3"}},
     {"scenario.yaml:20:22: error: initial.joints.shoulder is -3, beyond the joint's limits -2 to 2"}},
    {"final_rate_beyond_limit",
     {{"{match: velocity}", "{shoulder: 1.5}"}},
     {"scenario.yaml:33:27: error: approach.final_rates.shoulder is 1.5, beyond the joint's rate limit 1"}},
    {"rates_from_a_start_that_has_none",
     {{"  joints: {", "  joint_rates: {elbow: 0.1}\n  joints: {"}},
     {"scenario.yaml:32:3: error: approach.profile: the quartic profile starts from rest; with initial.joint_rates use "
      "quintic or cycloidal"}},
    {"post_impact_without_impact",
     {{"impact: {duration: 1e-3}\npost", "post"}},
     {"scenario.yaml:34:1: error: 'post_impact' needs 'impact' in the scenario"}},
    {"impact_without_grasps",
     {{"grasps:\n  - {end_effector: tip, target: ball, point: grip}\n", ""}},
     {"scenario.yaml:22:11: error: no grasp refers to target 'ball'; add a grasp or remove the target",
      "scenario.yaml:31:17: error: approach.final_rates.match needs 'grasps': there is no motion to match",
      "scenario.yaml:32:1: error: 'impact' needs 'grasps' in the scenario"}},
    {"empty_grasps",
     {{"grasps:\n  - {end_effector: tip, target: ball, point: grip}\n", "grasps: []\n"}},
     {"scenario.yaml:22:11: error: no grasp refers to target 'ball'; add a grasp or remove the target",
      "scenario.yaml:28:9: error: grasps has 0 items, must have at least 1"}},
    {"nothing_to_simulate",
     {{"approach:\n  duration: 20\n  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}\nimpact: {duration: "
       "1e-3}\npost_impact: {duration: 10}\n",
       ""}},
     {"scenario.yaml:1:1: error: nothing to simulate: state 'approach', 'impact' or both, or 'motion' without a "
      "capture"}},
    {"pd_without_gains",
     {{"  final_rates", "  tracking: {mode: pd, kp: 49}\n  final_rates"}},
     {"scenario.yaml:33:13: error: missing key 'kd' in approach.tracking, needed with mode: pd"}},
    {"negative_gain",
     {{"  final_rates", "  tracking: {mode: pd, kp: -49, kd: {shoulder: 1, elbow: -1}}\n  final_rates"}},
     {"scenario.yaml:33:28: error: approach.tracking.kp is -49, must be at least 0 [N m/rad or N/m; for "
      "computed_torque 1/s^2]",
      "scenario.yaml:33:58: error: approach.tracking.kd.elbow is -1, must be at least 0 [N m s/rad or N s/m; for "
      "computed_torque 1/s]"}},
    {"hinge_without_axis",
     {{"point: grip}", "point: grip, model: hinge}"}},
     {"scenario.yaml:29:5: error: missing key 'axis' in grasps[0], needed with model: hinge"}},
    {"hinge_axis_not_unit",
     {{"point: grip}", "point: grip, model: hinge, axis: [3, 0, 4]}"}},
     {"scenario.yaml:29:72: error: grasps[0].axis has length 5, must be a unit vector; normalised it is [0.6, 0, "
      "0.8]"}},
    {"refuse_without_limit",
     {{"\nimpact:", "\ncontact: {gap: refuse}\nimpact:"}},
     {"scenario.yaml:34:10: error: missing key 'limit' in contact, needed with gap: refuse"}},
    {"geometry_size_of_a_sphere",
     {{"    grasp_points", "    geometry: {shape: sphere, size: [1, 1, 1]}\n    grasp_points"}},
     {"scenario.yaml:26:15: error: missing key 'radius' in targets[0].geometry, needed with shape: sphere",
      "scenario.yaml:26:31: error: 'size' in targets[0].geometry has no meaning with shape: sphere"}},
};

INSTANTIATE_TEST_SUITE_P(Each, ScenarioFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(ScenarioFaults, SmallScenarioHasNone) { EXPECT_THAT(faults_of(kSmallScenario), testing::IsEmpty()); }

TEST(ScenarioFaults, AllAreFoundAtOnce) {
  // Errors of structure, values and the robot are reported together; none hides another.
  const std::string text = edited(kSmallScenario, {{"duration: 20", "duration: 0"},
                                                   {"target: ball", "target: bal"},
                                                   {"shoulder: 0.5", "sholder: 0.5"},
                                                   {"parent: upper", "parent: uper"},
                                                   {"mass: 10\n", "mas: 10\n"}});
  EXPECT_EQ(faults_of(text),
            (std::vector<std::string>{
                "scenario.yaml:13:15: error: unknown link 'uper' in robot.links[1]; did you mean 'upper'?",
                "scenario.yaml:20:12: error: unknown joint 'sholder' in initial.joints; did you mean 'shoulder'?",
                "scenario.yaml:23:5: error: unknown key 'mas' in targets[0]; did you mean 'mass'?",
                "scenario.yaml:29:33: error: unknown target 'bal' in grasps[0]; did you mean 'ball'?",
                "scenario.yaml:31:13: error: approach.duration is 0, must be greater than 0 [s]"}));
}

TEST(ScenarioFaults, WhatJoinsTheMessages) {
  const TemporaryFolder folder;
  const auto path =
      folder.write("s.yaml", edited(kSmallScenario, {{"duration: 20", "duration: 0"}, {"mass: 10\n", "mass: 0\n"}}));
  try {
    load_scenario(path);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    ASSERT_EQ(error.faults().size(), 2u);
    EXPECT_EQ(error.what(), error.faults()[0].text() + "\n" + error.faults()[1].text());
    EXPECT_EQ(error.faults()[0].file, path.string());
    EXPECT_EQ(error.faults()[0].line, 23);
    EXPECT_EQ(error.faults()[0].column, 11);
  }
}

TEST(ScenarioFaults, ColumnsCountCharacters) {
  const std::string text = edited(kSmallScenario, {{"{duration: 1e-3}", "{law: plästic, duration: 0}"}});
  EXPECT_EQ(faults_of(text),
            (std::vector<std::string>{
                "scenario.yaml:34:15: error: unknown value 'plästic' for impact.law; did you mean 'plastic'?",
                "scenario.yaml:34:34: error: impact.duration is 0, must be greater than 0 [s]"}));
}

TEST(ScenarioFaults, LongAndOddValuesStayOnOneReadableLine) {
  const auto faults =
      faults_of(edited(kSmallScenario, {{"duration: 20", "duration: \"a\\nb\\x01" + std::string(1000, 'x') + "\""}}));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0], "scenario.yaml:31:13: error: approach.duration must be a number [s], not the text 'a\\nb?" +
                           std::string(36, 'x') + "…'");
}

TEST(ScenarioFaults, InfiniteLimitsAreFine) {
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"lower: -2, upper: 2", "lower: -.inf, upper: .inf, effort: .inf"}})),
              testing::IsEmpty());
}

TEST(ScenarioFaults, ThereIsAnEndToThem) {
  std::string text = kSmallScenario;
  for (int i = 0; i < (test::kSanitized ? 1100 : 5000); ++i) text += "extra" + std::to_string(i) + ": 1\n";
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1001u);
  EXPECT_THAT(faults.back(), testing::EndsWith("error: too many errors; further errors are not listed"));
}

}  // namespace scenario_faults_test
}  // namespace grapnel::test
