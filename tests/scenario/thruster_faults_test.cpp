// Every kind of fault in thrusters and in what is asked of them and of wheels, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace thruster_faults_test {

class ThrusterFault : public testing::TestWithParam<FaultCase> {};

// The texts are the interface: they name the place, the value, what is allowed and what may have been meant.
TEST_P(ThrusterFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

Edit with_robot(const std::string& keys) { return {"base: {mass: 100,", keys + "\n  base: {mass: 100,"}; }
const Edit kClock{"impact: {duration: 1e-3}", "control: {period: 0.1}\nimpact: {duration: 1e-3}"};
const std::string kWheel = "wheels: [{name: a, axis: [0, 0, 1], inertia: 0.1, rate: 10}]";

// The first of twelve thrusters, in couples about x, y and z, one way and the other. `more`: keys of the first.
std::string couples(int count, const std::string& more = "") {
  std::string list;
  for (int i = 0; i < count; ++i) {
    const int axis = i / 4, sense = i / 2 % 2 == 0 ? 1 : -1, side = i % 2 == 0 ? 1 : -1;
    int p[3] = {0, 0, 0}, d[3] = {0, 0, 0};
    p[(axis + 1) % 3] = side, d[(axis + 2) % 3] = side * sense;
    const auto triple = [](const int* x) {
      return "[" + std::to_string(x[0]) + ", " + std::to_string(x[1]) + ", " + std::to_string(x[2]) + "]";
    };
    list += (i == 0 ? "" : ", ") + std::string("{name: t") + std::to_string(i) + ", position: " + triple(p) +
            ", direction: " + triple(d) + ", force: 1" + (i == 0 ? more : "") + ", specific_impulse: 200}";
  }
  return "thrusters: [" + list + "]";
}

const std::vector<FaultCase> kCases{
    {"thrusters_that_are_not_there",
     {with_approach("base_control: {kp: 1, kd: 1, actuators: thrusters}"), kClock},
     {"scenario.yaml:34:43: error: approach.base_control.actuators: thrusters, but the robot has none (thrusters: "
      "[...] in the robot file)"}},
    {"thrusters_that_turn_one_way_only",
     {with_robot(couples(10)), with_approach("base_control: {kp: 1, kd: 1, actuators: thrusters}"), kClock},
     {"scenario.yaml:35:17: error: approach.base_control: its gains require torque about z, which the robot's "
      "thrusters cannot give in both directions; state the gains per axis, with 0 for axes without control, or "
      "actuators: outside"}},
    {"pulse_widths_without_a_clock",
     {with_robot(couples(12)), with_approach("base_control: {kp: 1, kd: 1, actuators: thrusters}")},
     {"scenario.yaml:35:17: error: approach.base_control: thrusters with pulse_width fire in the periods of the "
      "control clock: control: {period: ...}"}},
    {"levels_the_wrong_way_round",
     {with_robot(couples(12)), with_approach("base_control: {kp: 1, kd: 1, actuators: thrusters, thrusters: "
                                             "{modulation: schmitt, level_on: 0.2, level_off: 0.3}}")},
     {"scenario.yaml:35:113: error: approach.base_control.thrusters.level_off is 0.3, must be less than level_on, "
      "0.2"}},
    {"modulation_of_nothing",
     {with_approach("base_control: {kp: 1, kd: 1, thrusters: {modulation: schmitt}}")},
     {"scenario.yaml:34:32: error: approach.base_control.thrusters: no thrusters are used; it requires actuators: "
      "thrusters, or dumping"}},
    {"pulses_longer_than_the_period",
     {with_robot(couples(12, ", min_on_time: 0.2")),
      with_approach("base_control: {kp: 1, kd: 1, actuators: thrusters}"), kClock},
     {"scenario.yaml:35:17: error: approach.base_control: thruster 't0' fires for 0.2 s or more (min_on_time), which "
      "must be less than control.period, 0.1 s, for pulse_width"}},
    {"dumping_without_wheels",
     {with_robot(couples(12)), with_approach("base_control: {kp: 1, kd: 1, dumping: {above: 2, below: 1, torque: 1}}"),
      kClock},
     {"scenario.yaml:35:32: error: approach.base_control.dumping: no wheels give the torque, so no momentum "
      "accumulates that could be dumped"}},
    {"dumping_without_thrusters",
     {with_robot(kWheel),
      with_approach("base_control: {kp: [0, 0, 1], kd: [0, 0, 1], dumping: {above: 1, below: 2, torque: 1}}"), kClock},
     {"scenario.yaml:35:48: error: approach.base_control.dumping: the robot has no thrusters (thrusters: [...] in the "
      "robot file)",
      "scenario.yaml:35:75: error: approach.base_control.dumping.below is 2 [N m s], must be less than above, 1"}},
    {"dumping_about_an_axis_that_thrusters_do_not_have",
     {with_robot(couples(8) + "\n  " + kWheel),
      with_approach("base_control: {kp: [0, 0, 1], kd: [0, 0, 1], thrusters: {modulation: schmitt}, dumping: {above: "
                    "2, below: 1, torque: 1}}"),
      kClock},
     {"scenario.yaml:36:72: error: approach.base_control.thrusters.modulation: dumping needs pulse_width",
      "scenario.yaml:36:82: error: approach.base_control.dumping: wheels accumulate momentum about z, about which the "
      "robot's thrusters cannot give torque in both directions"}},
    {"wheel_speeds_of_no_wheels",
     {with_approach("base_control: {kp: 1, kd: 1, wheel_speed_rate: 0.1}")},
     {"scenario.yaml:34:50: error: approach.base_control.wheel_speed_rate: no wheels give the torque"}},
    {"wheel_speeds_that_do_not_fit",
     {with_robot(kWheel), with_approach("base_control: {kp: [0, 0, 1], kd: [0, 0, 1], wheel_speeds: [20]}")},
     {"scenario.yaml:35:62: error: approach.base_control.wheel_speeds: without wheel_speed_rate the wheels do not "
      "reach these rates",
      "scenario.yaml:35:62: error: approach.base_control.wheel_speeds: 20 rad/s of wheel 'a', whose maximum rate is 10 "
      "rad/s"}},
    {"thrusters_of_no_use",
     {with_robot("thrusters: [{name: t, position: [0, 0, 0], direction: [1, 1, 0], force: 0, specific_impulse: 200, "
                 "min_on_time: -1, plume: {half_angle: 2, range: 1}}, {name: t, position: [0, 0, 0], direction: [1, 0, "
                 "0], force: 1}]\n  propellant: 0")},
     {"scenario.yaml:4:57: error: robot.thrusters[0].direction has length 1.41421356, must be a unit vector; "
      "normalised it is [0.7071067811865475, 0.7071067811865475, 0]",
      "scenario.yaml:4:75: error: robot.thrusters[0].force is 0, must be greater than 0 [N]",
      "scenario.yaml:4:114: error: robot.thrusters[0].min_on_time is -1, must be at least 0 [s]",
      "scenario.yaml:4:138: error: robot.thrusters[0].plume.half_angle is 2, must be greater than 0 and at most 1.5 "
      "[rad]",
      "scenario.yaml:4:153: error: missing key 'specific_impulse' in robot.thrusters[1]",
      "scenario.yaml:4:160: error: duplicate name 't' in robot.thrusters[1]: thruster names must differ; first given "
      "in line 4",
      "scenario.yaml:5:15: error: robot.propellant is 0, must be greater than 0 [kg]"}},
};

INSTANTIATE_TEST_SUITE_P(All, ThrusterFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace thruster_faults_test
}  // namespace grapnel::test
