// Every kind of fault in control moment gyros, in arrays of them and of wheels, and in what is asked of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace gyro_faults_test {

class GyroFault : public testing::TestWithParam<FaultCase> {};

TEST_P(GyroFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

Edit with_robot(const std::string& keys) { return {"base: {mass: 100,", keys + "\n  base: {mass: 100,"}; }

std::string gyro(const std::string& name, const std::string& gimbal, const std::string& spin,
                 const std::string& gimbal_inertia = "0.02") {
  return "{name: " + name + ", gimbal_axis: " + gimbal + ", spin_axis: " + spin +
         ", inertia: 0.01, spin_rate: 6000 rpm, gimbal_inertia: " + gimbal_inertia + "}";
}
const std::string kX = "[1, 0, 0]", kY = "[0, 1, 0]", kZ = "[0, 0, 1]";

const std::vector<FaultCase> kCases{
    {"gyros_that_are_not_there",
     {with_approach("base_control: {kp: 1, kd: 1, actuators: gyros}")},
     {"scenario.yaml:34:43: error: approach.base_control.actuators: gyros, but the robot has none (gyros: [...] in the "
      "robot file)"}},
    {"too_few_gyros",
     {with_robot("gyros: [" + gyro("a", kX, kY) + ", " + gyro("b", kY, kZ) + "]"),
      with_approach("base_control: {kp: 1, kd: 1}")},
     {"scenario.yaml:35:17: error: approach.base_control: the robot's 2 gyros cannot give torque about all axes; use "
      "three or more, or actuators: outside"}},
    {"gimbals_about_one_axis",
     {with_robot("gyros: [" + gyro("a", kZ, kY) + ", " + gyro("b", kZ, kX) + ", " + gyro("c", kZ, kX) + "]"),
      with_approach("base_control: {kp: 1, kd: 1}")},
     {"scenario.yaml:35:17: error: approach.base_control: all gimbals of the robot's gyros turn about z, so they can "
      "give no torque about this axis"}},
    {"axes_that_are_not_perpendicular",
     {with_robot("gyros: [" + gyro("a", kX, "[0.6, 0.8, 0]") + "]")},
     {"scenario.yaml:4:56: error: robot.gyros[0].spin_axis must be perpendicular to gimbal_axis; their dot product is "
      "0.6"}},
    {"gimbals_lighter_than_their_rotors",
     {with_robot("gyros: [" + gyro("a", kX, kY, "0.005") + "]")},
     {"scenario.yaml:4:119: error: robot.gyros[0].gimbal_inertia is 0.005 [kg m^2], must be more than half of inertia, "
      "0.005, which the rotor has across its axis"}},
    {"names_twice",
     {with_robot("gyros: [" + gyro("a", kX, kY) + ", " + gyro("a", kY, kX) + "]")},
     {"scenario.yaml:4:133: error: duplicate name 'a' in robot.gyros[1]: gyro names must differ; first given in line "
      "4"}},
    {"angles_that_do_not_fit",
     {with_robot("gyros: [" + gyro("a", kX, kY) + "]"), {"initial:\n", "initial:\n  gimbal_angles: [0, 1]\n"}},
     {"scenario.yaml:21:18: error: initial.gimbal_angles: 2 values, the robot has 1 gyros"}},
    {"steering_of_nothing",
     {with_approach("base_control: {kp: 1, kd: 1, steering: {near: 0.3}}")},
     {"scenario.yaml:34:32: error: approach.base_control.steering: no gyros are used; it requires actuators: gyros"}},
    {"an_array_and_a_list",
     {with_robot("gyros: [" + gyro("a", kX, kY) +
                 "]\n  gyro_array: {configuration: orthogonal, inertia: 0.01, spin_rate: "
                 "6000 rpm, gimbal_inertia: 0.02}")},
     {"scenario.yaml:5:3: error: robot has both 'gyros' and 'gyro_array', only one is allowed"}},
    {"a_skew_of_three_axes",
     {with_robot("wheel_array: {configuration: orthogonal, skew: 0.5, inertia: 0.01}")},
     {"scenario.yaml:4:44: error: 'skew' in robot.wheel_array has no meaning with configuration: orthogonal"}},
};

INSTANTIATE_TEST_SUITE_P(Every, GyroFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace gyro_faults_test
}  // namespace grapnel::test
