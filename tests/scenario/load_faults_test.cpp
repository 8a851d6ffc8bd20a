// Every kind of fault in external wrenches and clearances, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace load_faults_test {

class LoadFault : public testing::TestWithParam<FaultCase> {};

// The texts are the interface: they name the place, the value, what is allowed and what may have been meant.
TEST_P(LoadFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

const std::vector<FaultCase> kCases{
    {"wrench_on_nothing",
     {with_wrench("{force: [1, 0, 0]}")},
     {"scenario.yaml:35:5: error: missing key in external_wrenches[0]: give 'body' or 'target'"}},
    {"wrench_on_two",
     {with_wrench("{body: base, target: ball, force: [1, 0, 0]}")},
     {"scenario.yaml:35:18: error: external_wrenches[0] has both 'body' and 'target', only one is allowed"}},
    {"wrench_unknown_body",
     {with_wrench("{body: bas, force: [1, 0, 0]}")},
     {"scenario.yaml:35:12: error: unknown link 'bas' in external_wrenches[0]; did you mean 'base'?"}},
    {"wrench_unknown_target",
     {with_wrench("{target: base, force: [1, 0, 0]}")},
     {"scenario.yaml:35:14: error: unknown target 'base' in external_wrenches[0]; targets are ball"}},
    {"wrench_unknown_frame",
     {with_wrench("{body: base, frame: bdy}")},
     {"scenario.yaml:35:25: error: unknown value 'bdy' for external_wrenches[0].frame; did you mean 'body'?"}},
    {"wrench_short_force",
     {with_wrench("{body: base, force: [1, 0], torque: 3}")},
     {"scenario.yaml:35:25: error: external_wrenches[0].force has 2 items, must have exactly 3",
      "scenario.yaml:35:41: error: external_wrenches[0].torque must be a list of 3 numbers [N m], not the number 3"}},
    {"wrench_unknown_key",
     {with_wrench("{body: base, forc: [1, 0, 0]}")},
     {"scenario.yaml:35:18: error: unknown key 'forc' in external_wrenches[0]; did you mean 'force'?"}},
    {"wrenches_no_list",
     {with_top("external_wrenches: {body: base}")},
     {"scenario.yaml:34:20: error: external_wrenches must be a list, not a mapping"}},
    {"profile_without_shape",
     {with_wrench("{body: base, time: {start: 1}}")},
     {"scenario.yaml:35:24: error: missing key 'shape' in external_wrenches[0].time"}},
    {"profile_unknown_shape",
     {with_wrench("{body: base, time: {shape: halfsine}}")},
     {"scenario.yaml:35:32: error: unknown value 'halfsine' for external_wrenches[0].time.shape; did you mean "
      "'half_sine'?"}},
    {"half_sine_without_end",
     {with_wrench("{body: base, time: {shape: half_sine, start: 1}}")},
     {"scenario.yaml:35:24: error: missing key 'end' in external_wrenches[0].time, needed with shape: half_sine"}},
    {"half_sine_with_frequency",
     {with_wrench("{body: base, time: {shape: half_sine, end: 1, frequency: 1}}")},
     {"scenario.yaml:35:51: error: 'frequency' in external_wrenches[0].time has no meaning with shape: half_sine"}},
    {"sine_without_frequency",
     {with_wrench("{body: base, time: {shape: sine}}")},
     {"scenario.yaml:35:24: error: missing key 'frequency' in external_wrenches[0].time, needed with shape: sine"}},
    {"sine_frequency_zero",
     {with_wrench("{body: base, time: {shape: sine, frequency: 0}}")},
     {"scenario.yaml:35:49: error: external_wrenches[0].time.frequency is 0, must be greater than 0 [Hz]"}},
    {"end_before_start",
     {with_wrench("{body: base, time: {shape: constant, start: 2, end: 1}}")},
     {"scenario.yaml:35:57: error: external_wrenches[0].time ends at 1 [s], must end after its start at 2"}},
    {"end_before_absent_start",
     {with_wrench("{body: base, time: {shape: sine, frequency: 1, end: 0}}")},
     {"scenario.yaml:35:57: error: external_wrenches[0].time ends at 0 [s], must end after its start at 0"}},
    {"table_without_values",
     {with_wrench("{body: base, time: {shape: table, start: 1}}")},
     {"scenario.yaml:35:24: error: missing key 'values' in external_wrenches[0].time, needed with shape: table",
      "scenario.yaml:35:39: error: 'start' in external_wrenches[0].time has no meaning with shape: table"}},
    {"table_with_force",
     {with_wrench("{body: base, force: [1, 0, 0], torque: [0, 0, 0], time: {shape: table, values: [[0, 1, 0, 0, 0, 0, "
                  "0], [1, 0, 0, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:18: error: 'force' in external_wrenches[0] has no effect with time.shape: table, whose values "
      "are the wrench",
      "scenario.yaml:35:36: error: 'torque' in external_wrenches[0] has no effect with time.shape: table, whose values "
      "are the wrench"}},
    {"table_of_one_row",
     {with_wrench("{body: base, time: {shape: table, values: [[0, 1, 0, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:47: error: external_wrenches[0].time.values has 1 item, must have at least 2"}},
    {"table_of_short_rows",
     {with_wrench("{body: base, time: {shape: table, values: [[0, 1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:71: error: external_wrenches[0].time.values[1] has 6 items, must have exactly 7"}},
    {"table_out_of_order",
     {with_wrench("{body: base, time: {shape: table, values: [[1, 1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:72: error: external_wrenches[0].time.values[1]: time 1 must be greater than 1 of the row "
      "before"}},
    {"table_not_a_number",
     {with_wrench("{body: base, time: {shape: table, values: [[.nan, 1, 0, 0, 0, 0, 0], [1, 0, x, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:49: error: external_wrenches[0].time.values[0][0] is .nan, must be a finite number [s, N, N m]",
      "scenario.yaml:35:81: error: external_wrenches[0].time.values[1][2] must be a number [s, N, N m], not the text "
      "'x'"}},
    {"orbit_without_size",
     {with_top("orbit: {}")},
     {"scenario.yaml:34:8: error: missing key in orbit: give 'altitude' or 'semi_major_axis'"}},
    {"orbit_with_two_sizes",
     {with_top("orbit: {altitude: 400 km, semi_major_axis: 7000 km}")},
     {"scenario.yaml:34:27: error: orbit has both 'altitude' and 'semi_major_axis', only one is allowed"}},
    {"orbit_without_unit",
     {with_top("orbit: {altitude: 400}")},
     {"scenario.yaml:34:19: error: orbit.altitude is 400, must be at least 10000 [m]"}},
    {"orbit_altitude_of_an_ellipse",
     {with_top("orbit: {altitude: 400 km, eccentricity: 0.1, mu: 4e14}")},
     {"scenario.yaml:34:27: error: 'eccentricity' in orbit has no meaning with altitude: an altitude defines a "
      "circular orbit; use semi_major_axis",
      "scenario.yaml:34:46: error: 'mu' in orbit has no meaning with altitude: an altitude refers to the surface of "
      "body; use semi_major_axis"}},
    {"orbit_unknown_body",
     {with_top("orbit: {body: moons, altitude: 100 km}")},
     {"scenario.yaml:34:15: error: unknown value 'moons' for orbit.body; did you mean 'moon'?"}},
    {"orbit_open",
     {with_top("orbit: {semi_major_axis: 7000 km, eccentricity: 1}")},
     {"scenario.yaml:34:49: error: orbit.eccentricity is 1, must be between 0 and 0.99"}},
    {"orbit_through_the_ground",
     {with_top("orbit: {semi_major_axis: 7000 km, eccentricity: 0.2}")},
     {"scenario.yaml:34:26: error: orbit: its lowest point is 5.6e+06 m from the centre of the body earth, below its "
      "surface at 6.37814e+06; lengths are in m, or carry their unit (7000 km)"}},
    {"orbit_axes_not_square",
     {with_top("orbit: {altitude: 400 km, radial: [1, 0, 0], along_track: [0.6, 0.8, 0]}")},
     {"scenario.yaml:34:59: error: orbit.along_track must be perpendicular to orbit.radial; their dot product is 0.6, "
      "the "
      "angle between them 53.13 degrees"}},
    {"orbit_axes_by_half",
     {with_top("orbit: {altitude: 400 km, radial: [1, 0, 0]}")},
     {"scenario.yaml:34:27: error: 'radial' needs 'along_track' in orbit"}},
    {"orbit_axes_not_unit",
     {with_top("orbit: {altitude: 400 km, radial: [2, 0, 0], along_track: [0, 1, 0]}")},
     {"scenario.yaml:34:35: error: orbit.radial has length 2, must be a unit vector; normalised it is [1, 0, 0]"}},
    {"orbit_with_gravity",
     {with_top("orbit: {altitude: 400 km}\ngravity: [0, 0, -9.81]")},
     {"scenario.yaml:35:1: error: gravity: it is for test beds on the ground; leave it out with 'orbit', whose frame "
      "is in free fall"}},
    {"orbit_of_a_fixed_base",
     {with_top("orbit: {altitude: 400 km}"), {"base: {mass: 100", "base: {mode: fixed, mass: 100"}},
     {"scenario.yaml:34:1: error: orbit: the robot's base is fixed to the ground, which is not in orbit; use base mode "
      "free or held"}},
    {"orbit_far_away",
     {with_top("orbit: {altitude: 400 km}"), {"position: [2, 0, 0]", "position: [200 km, 0, 0]"}},
     {"scenario.yaml:25:23: error: targets[0].state.position: 200000 m from the orbit's reference point, which is W's "
      "origin; the field near an orbit is linear and holds within 67781.4 m"}},
    {"orbit_on_the_way_out",
     {with_top("orbit: {altitude: 400 km}"), {"initial:\n", "initial:\n  base: {velocity: [0, 7700, 0]}\n"}},
     {"scenario.yaml:20:20: error: initial.base.velocity: it leads 231000 m away from the orbit's reference point "
      "within "
      "the run; velocities are relative to the orbit, and its field is linear and holds within 67781.4 m"}},
    {"wrench_in_no_orbit",
     {with_wrench("{body: base, frame: orbit, force: [1, 0, 0]}")},
     {"scenario.yaml:35:25: error: external_wrenches[0].frame: orbit needs 'orbit' in the scenario"}},
    {"stream_that_turns",
     {with_wrench(
         "{body: base, frame: body, stream: {direction: [1, 0, 0], pressure: 1, area: 1, normal: [1, 0, 0]}}")},
     {"scenario.yaml:35:25: error: external_wrenches[0].frame: body is not defined for a stream, which does not turn "
      "with the body; use world or orbit"}},
    {"stream_of_too_many_shares",
     {with_wrench("{body: base, stream: {direction: [1, 0, 0], pressure: 1, area: 1, normal: [1, 0, 0], specular: 0.6, "
                  "diffuse: 0.5}}")},
     {"scenario.yaml:35:26: error: external_wrenches[0].stream: the sum of specular and diffuse is "
      "1.1, must be at most 1"}},
    {"stream_without_normal",
     {with_wrench("{body: base, stream: {direction: [1, 1, 0], pressure: -1, area: 1}}")},
     {"scenario.yaml:35:26: error: missing key 'normal' in external_wrenches[0].stream",
      "scenario.yaml:35:38: error: external_wrenches[0].stream.direction has length 1.41421356, must be a unit vector; "
      "normalised it is [0.7071067811865475, 0.7071067811865475, 0]",
      "scenario.yaml:35:59: error: external_wrenches[0].stream.pressure is -1, must be at least 0 [N/m^2]"}},
    {"stream_beside_a_table",
     {with_wrench("{body: base, stream: {direction: [1, 0, 0], pressure: 1, area: 1, normal: [1, 0, 0]}, time: {shape: "
                  "table, values: [[0, 1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]]}}")},
     {"scenario.yaml:35:18: error: 'stream' in external_wrenches[0] has no effect with time.shape: table, whose values "
      "are the wrench"}},
    {"clearance_not_boolean",
     {with_top("clearance: {enabled: yes, required: -1}")},
     {"scenario.yaml:34:22: error: clearance.enabled must be true or false, not the text 'yes'",
      "scenario.yaml:34:37: error: clearance.required is -1, must be at least 0 [m]"}},
    {"clearance_enabled_number",
     {with_top("clearance: {enabled: 1}")},
     {"scenario.yaml:34:22: error: clearance.enabled must be true or false, not the number 1"}},
    {"clearance_enabled_empty",
     {with_top("clearance: {enabled: }")},
     {"scenario.yaml:34:13: error: clearance.enabled is empty, must be true or false"}},
    {"clearance_quoted_boolean",
     {with_top("clearance: {enabled: 'true'}")},
     {"scenario.yaml:34:22: error: clearance.enabled must be true or false, not the text 'true'"}},
    {"clearance_three_bodies",
     {with_top("clearance: {ignore: [[base, upper, lower]]}")},
     {"scenario.yaml:34:22: error: clearance.ignore[0] has 3 items, must have exactly 2"}},
    {"clearance_no_pairs",
     {with_top("clearance: {ignore: [base, upper]}")},
     {"scenario.yaml:34:22: error: clearance.ignore[0] must be a list of 2 names, not the text 'base'",
      "scenario.yaml:34:28: error: clearance.ignore[1] must be a list of 2 names, not the text 'upper'"}},
    {"clearance_unknown_body",
     {with_top("clearance: {ignore: [[base, balll], [uper, ball], [elbow, tip]]}")},
     {"scenario.yaml:34:29: error: unknown body 'balll' in clearance.ignore[0]; did you mean 'ball'?",
      "scenario.yaml:34:38: error: unknown body 'uper' in clearance.ignore[1]; did you mean 'upper'?",
      "scenario.yaml:34:52: error: unknown body 'elbow' in clearance.ignore[2]; bodies are base, upper, lower, ball",
      "scenario.yaml:34:59: error: unknown body 'tip' in clearance.ignore[2]; bodies are base, upper, lower, ball"}},
    {"clearance_one_body_twice",
     {with_top("clearance: {ignore: [[ball, ball]]}")},
     {"scenario.yaml:34:29: error: clearance.ignore[0] names 'ball' twice"}},
};

INSTANTIATE_TEST_SUITE_P(Each, LoadFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace load_faults_test
}  // namespace grapnel::test
