// Input errors in approaches, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace approach_faults_test {

class ApproachFault : public testing::TestWithParam<FaultCase> {};

// Messages are part of the interface: they state the location, the value, the allowed values and a suggestion.
TEST_P(ApproachFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

// A plan with a capture window, in place of the duration and the trajectory.
Edit window(const std::string& text) {
  return {"  duration: 20\n  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}",
          "  window: " + text + "\n  plan: {}"};
}

// A robot with one wheel. `more`: further keys of the wheel.
Edit with_wheel(const std::string& more) {
  return {"base: {mass: 100,",
          "wheels: [{name: w, axis: [0, 0, 1], inertia: 0.05, torque: 0.4" + more + "}]\n  base: {mass: 100,"};
}

const std::vector<FaultCase> kCases{
    {"approach_axis_not_unit",
     {with_tip("approach_axis: [1, 1, 0]")},
     {"scenario.yaml:18:68: error: robot.end_effectors[0].approach_axis has length 1.41421356, must be a unit vector; "
      "normalised it is [0.7071067811865475, 0.7071067811865475, 0]"}},
    {"approach_direction_not_unit",
     {with_point("approach_direction: [0, 0, 0]")},
     {"scenario.yaml:27:65: error: targets[0].grasp_points[0].approach_direction has length 0, must be a unit vector",
      "scenario.yaml:29:20: error: grasps[0]: grasp point 'grip' has an approach_direction, but end-effector 'tip' has "
      "no approach_axis; add one, or set orientation: free for the grasp"}},
    {"approach_direction_too_short",
     {with_point("approach_direction: [0, 1]")},
     {"scenario.yaml:27:65: error: targets[0].grasp_points[0].approach_direction has 2 items, must have exactly 3",
      "scenario.yaml:29:20: error: grasps[0]: grasp point 'grip' has an approach_direction, but end-effector 'tip' has "
      "no approach_axis; add one, or set orientation: free for the grasp"}},
    {"envelope_empty",
     {with_tip("envelope: {}")},
     {"scenario.yaml:18:63: error: robot.end_effectors[0].envelope is empty, must have at least one of position, "
      "angle, velocity, angular_velocity"}},
    {"envelope_zero",
     {with_tip("envelope: {position: 0, velocity: 0.1}")},
     {"scenario.yaml:18:74: error: robot.end_effectors[0].envelope.position is 0, must be greater than 0 [m]"}},
    {"envelope_unknown_key",
     {with_tip("envelope: {positon: 0.1}")},
     {"scenario.yaml:18:64: error: unknown key 'positon' in robot.end_effectors[0].envelope; did you mean "
      "'position'?"}},
    {"orientation_unknown",
     {with_grasp("orientation: axes")},
     {"scenario.yaml:29:65: error: unknown value 'axes' for grasps[0].orientation; did you mean 'axis'?"}},
    {"orientation_axis_without_anything",
     {with_grasp("orientation: axis")},
     {"scenario.yaml:29:65: error: grasps[0].orientation: axis needs an 'approach_direction' at grasp point 'grip' of "
      "target 'ball'",
      "scenario.yaml:29:65: error: grasps[0].orientation: axis needs an 'approach_axis' at end-effector 'tip'"}},
    {"orientation_axis_without_approach_axis",
     {with_point("approach_direction: [0, -1, 0]"), with_grasp("orientation: axis")},
     {"scenario.yaml:29:65: error: grasps[0].orientation: axis needs an 'approach_axis' at end-effector 'tip'"}},
    {"orientation_by_default_without_approach_axis",
     {with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:29:20: error: grasps[0]: grasp point 'grip' has an approach_direction, but end-effector 'tip' has "
      "no approach_axis; add one, or set orientation: free for the grasp"}},
    {"capsule_without_length",
     {{"    grasp_points", "    geometry: {shape: capsule, radius: 1}\n    grasp_points"}},
     {"scenario.yaml:26:15: error: missing key 'length' in targets[0].geometry, needed with shape: capsule"}},
    {"capsule_with_size",
     {{"    grasp_points", "    geometry: {shape: capsule, radius: 1, length: 1, size: [1, 1, 1]}\n    grasp_points"}},
     {"scenario.yaml:26:54: error: 'size' in targets[0].geometry has no meaning with shape: capsule"}},
    {"no_motion_given",
     {with_motion("profile: quintic")},
     {"scenario.yaml:31:3: error: missing key in approach: give 'final_joints', 'plan', 'trajectory' or 'pieces'"}},
    {"two_forms_given",
     {with_motion("final_joints: [0.2, -0.4]\n  plan: {}")},
     {"scenario.yaml:33:3: error: approach has both 'final_joints' and 'plan', only one is allowed"}},
    {"one_form_given_twice",
     {with_motion("plan: {}\n  plan: {}")},
     {"scenario.yaml:33:3: error: duplicate key 'plan' in approach; first given in line 32"}},
    {"three_forms_given",
     {with_motion("trajectory: no.csv\n  plan: {}\n  final_joints: [0.2, -0.4]")},
     {"scenario.yaml:32:15: error: cannot read the file 'no.csv': no such file",
      "scenario.yaml:33:3: error: approach has both 'trajectory' and 'plan', only one is allowed",
      "scenario.yaml:34:3: error: approach has both 'trajectory' and 'final_joints', only one is allowed"}},
    {"final_joints_without_duration",
     {{"  duration: 20\n", ""}},
     {"scenario.yaml:31:3: error: 'final_joints' needs 'duration' in approach"}},
    {"plan_without_duration",
     {{"  duration: 20\n", ""}, with_motion("plan: {}")},
     {"scenario.yaml:31:3: error: missing key in approach: give 'duration' or 'window'"}},
    {"window_beside_duration",
     {with_motion("plan: {}\n  window: {earliest: 5, latest: 20}")},
     {"scenario.yaml:33:3: error: approach has both 'duration' and 'window', only one is allowed"}},
    {"window_without_plan",
     {{"  duration: 20\n", "  window: {earliest: 5, latest: 20}\n"}},
     {"scenario.yaml:31:3: error: 'window' needs 'plan' in approach",
      "scenario.yaml:32:3: error: 'final_joints' needs 'duration' in approach"}},
    {"window_empty",
     {window("{}")},
     {"scenario.yaml:31:11: error: missing key 'earliest' in approach.window",
      "scenario.yaml:31:11: error: missing key 'latest' in approach.window"}},
    {"window_out_of_range",
     {window("{earliest: 0, latest: 20, step: -1, choose: sooner}")},
     {"scenario.yaml:31:22: error: approach.window.earliest is 0, must be greater than 0 [s]",
      "scenario.yaml:31:43: error: approach.window.step is -1, must be at least 0 [s]",
      "scenario.yaml:31:55: error: unknown value 'sooner' for approach.window.choose; did you mean 'soonest'?"}},
    {"window_reversed",
     {window("{earliest: 20, latest: 5}")},
     {"scenario.yaml:31:34: error: approach.window.latest is 5 [s], must be greater than 20, earliest"}},
    {"window_of_too_many_times",
     {window("{earliest: 1, latest: 20, step: 1e-3}")},
     {"scenario.yaml:31:43: error: approach.window.step is 0.001 [s], which makes 1.9e+04 times; at most 10000 are "
      "allowed"}},
    {"window_by_no_objective",
     {{"  duration: 20\n", "  window: {earliest: 5, latest: 20}\n"}, with_motion("plan: {objective: as_found}")},
     {"scenario.yaml:31:11: error: approach.window.choose: objective needs an objective, but approach.plan.objective "
      "is as_found; choose soonest or slowest, or another objective"}},
    {"window_with_a_straight_piece_too_long",
     {{"  duration: 20\n", "  window: {earliest: 5, latest: 20}\n"},
      with_motion("plan: {}\n  straight_in: {stand_off: 0.1, duration: 5}"),
      with_tip("approach_axis: [1, 0, 0]"),
      with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:33:43: error: approach.straight_in.duration is 5 [s], must be less than approach.window.earliest, "
      "5"}},
    {"window_with_a_waypoint_too_late",
     {window("{earliest: 5, latest: 20}"), with_approach("waypoints: [{time: 6, joints: [0, 0]}]")},
     {"scenario.yaml:33:22: error: approach.waypoints[0].time is 6 [s], must be less than 5, "
      "approach.window.earliest"}},
    {"window_with_a_grasp_too_late",
     {window("{earliest: 5, latest: 20}"), with_grasp("closes_at: 16")},
     {"scenario.yaml:29:63: error: grasps[0].closes_at is 16 [s], must be at most 15, the end of post_impact"}},
    {"window_with_rare_replanning",
     {{"  duration: 20\n", "  window: {earliest: 5, latest: 20}\n"},
      with_motion("profile: quintic\n  plan: {}\n  replan: {every: 5}")},
     {"scenario.yaml:34:19: error: approach.replan.every is 5 [s], must be less than 5, approach.window.earliest"}},
    {"plan_empty", {with_motion("plan:")}, {"scenario.yaml:32:3: error: approach.plan is empty, must be a mapping"}},
    {"plan_without_grasps",
     {with_motion("plan: {}"),
      {"grasps:\n  - {end_effector: tip, target: ball, point: grip}\n", ""},
      {"\nimpact: {duration: 1e-3}\npost_impact: {duration: 10}", ""}},
     {"scenario.yaml:22:11: error: no grasp refers to target 'ball'; add a grasp or remove the target",
      "scenario.yaml:30:3: error: approach.plan needs 'grasps': there is no point to reach"}},
    {"plan_unknown_measure",
     {with_motion("plan: {objective: nearby}")},
     {"scenario.yaml:32:21: error: unknown value 'nearby' for approach.plan.objective; allowed are excursion, nearest, "
      "limits, manipulability, as_found, effort, base_attitude, base_motion, clearance, impulse, impulse_index, "
      "wheel_momentum"}},
    {"plan_objective_and_weights",
     {with_motion("plan: {objective: effort, weights: {effort: 1}}")},
     {"scenario.yaml:32:29: error: approach.plan has both 'objective' and 'weights', only one is allowed"}},
    {"plan_weight_negative",
     {with_motion("plan: {weights: {effort: -1}}")},
     {"scenario.yaml:32:28: error: approach.plan.weights.effort is -1, must be at least 0 [1/(N m)^2]"}},
    {"plan_weights_of_nothing",
     {with_motion("plan: {weights: {effort: 0}}")},
     {"scenario.yaml:32:19: error: approach.plan.weights: all weights are zero; state a weight, or objective: "
      "as_found, which minimizes nothing"}},
    {"plan_nearest_weight_without_guess",
     {with_motion("plan: {weights: {nearest: 1}}")},
     {"scenario.yaml:32:29: error: approach.plan.weights.nearest needs approach.plan.guess"}},
    {"plan_contacts_without_clearance",
     {with_motion("plan: {contacts: allowed}")},
     {"scenario.yaml:32:10: error: 'contacts' needs 'clearance' in approach.plan"}},
    {"plan_near_grasp_without_clearance",
     {with_motion("plan: {near_grasp: 1}")},
     {"scenario.yaml:32:10: error: 'near_grasp' needs 'clearance' in approach.plan"}},
    {"plan_clearance_switched_off",
     {with_motion("plan: {clearance: 0.1}\nclearance: {enabled: false}")},
     {"scenario.yaml:32:21: error: approach.plan.clearance: 'clearance' is switched off, so no distances are "
      "evaluated"}},
    {"plan_clearance_wanted_and_switched_off",
     {with_motion("plan: {objective: clearance}\nclearance: {enabled: false}")},
     {"scenario.yaml:32:21: error: approach.plan.objective: clearance: 'clearance' is switched off, so no distances "
      "are evaluated"}},
    {"plan_impulse_at_the_stand_off",
     {with_point("approach_direction: [1, 0, 0]"), with_tip("approach_axis: [1, 0, 0]"),
      with_motion("plan: {weights: {impulse: 1}}\n  straight_in: {stand_off: 0.2, duration: 2}")},
     {"scenario.yaml:32:19: error: approach.plan.weights.impulse: the plan ends at the stand-off "
      "of straight_in, where no grasp closes; leave out one of them"}},
    {"plan_turn_none",
     {with_motion("plan: {base_turn: 0}")},
     {"scenario.yaml:32:21: error: approach.plan.base_turn is 0, must be greater than 0 [rad]"}},
    {"plan_wheel_budget_without_wheels",
     {with_motion("plan: {wheel_momentum: 0.5}")},
     {"scenario.yaml:32:26: error: approach.plan.wheel_momentum needs wheels that control the base's attitude: wheels: "
      "[...] in the robot file, and approach.base_control that uses them"}},
    {"plan_wheel_budget_without_base_control",
     {with_wheel(", rate: 400"), with_motion("plan: {objective: wheel_momentum}")},
     {"scenario.yaml:33:21: error: approach.plan.objective: wheel_momentum needs wheels that control the base's "
      "attitude: "
      "wheels: [...] in the robot file, and approach.base_control that uses them"}},
    {"plan_wheel_budget_of_wheels_without_rates",
     {with_wheel(""),
      with_motion(
          "plan: {wheel_momentum: 1.5, weights: {wheel_momentum: 1}}\n  base_control: {kp: [0, 0, 1], kd: [0, 0, 1]}")},
     {"scenario.yaml:33:26: error: approach.plan.wheel_momentum is 1.5, must be greater than 0 and at most 1 [1]",
      "scenario.yaml:33:26: error: approach.plan.wheel_momentum: wheel 'w' has no maximum rate ('rate' in the robot "
      "file), so its momentum is unlimited"}},
    {"plan_wheel_budget_and_dumping",
     {with_wheel(", rate: 400"),
      with_motion(
          "plan: {wheel_momentum: 0.5}\n  base_control: {kp: [0, 0, 1], kd: [0, 0, 1], dumping: {above: 2, below: 1, "
          "torque: 1}}\ncontrol: {period: 0.1}")},
     {"scenario.yaml:33:26: error: approach.plan.wheel_momentum: a plan cannot include thrusters that dump the wheels' "
      "momentum "
      "(approach.base_control.dumping)",
      "scenario.yaml:34:48: error: approach.base_control.dumping: the robot has no thrusters (thrusters: [...] in the "
      "robot file)"}},
    {"plan_knots_too_many",
     {with_motion("plan: {knots: 31}")},
     {"scenario.yaml:32:17: error: approach.plan.knots is 31, must be between 0 and 30"}},
    {"plan_nearest_without_guess",
     {with_motion("plan: {objective: nearest}")},
     {"scenario.yaml:32:9: error: missing key 'guess' in approach.plan, needed with objective: nearest"}},
    {"plan_guess_beyond_limit",
     {with_motion("plan: {guess: {shoulder: 3, elbow: 0}}")},
     {"scenario.yaml:32:28: error: approach.plan.guess.shoulder is 3, beyond the joint's limits -2 to 2"}},
    {"plan_guess_of_one",
     {with_motion("plan: {guess: {elbow: 0}}")},
     {"scenario.yaml:32:17: error: approach.plan.guess lacks joints: shoulder"}},
    {"plan_starts_none",
     {with_motion("plan: {starts: 0}")},
     {"scenario.yaml:32:18: error: approach.plan.starts is 0, must be between 1 and 1000"}},
    {"plan_starts_too_many",
     {with_motion("plan: {starts: 1001}")},
     {"scenario.yaml:32:18: error: approach.plan.starts is 1001, must be between 1 and 1000"}},
    {"plan_starts_not_whole",
     {with_motion("plan: {starts: 2.5}")},
     {"scenario.yaml:32:18: error: approach.plan.starts must be a whole number, not 2.5"}},
    {"plan_seed_negative",
     {with_motion("plan: {seed: -1}")},
     {"scenario.yaml:32:16: error: approach.plan.seed is -1, must be between 0 and 9007199254740991"}},
    {"plan_seed_inexact",
     {with_motion("plan: {seed: 9007199254740993}")},
     {"scenario.yaml:32:16: error: approach.plan.seed is 9007199254740993, must be between 0 and 9007199254740991"}},
    {"waypoint_without_time",
     {with_approach("waypoints: [{joints: [0, 0]}]")},
     {"scenario.yaml:34:15: error: missing key 'time' in approach.waypoints[0]"}},
    {"waypoint_at_the_start",
     {with_approach("waypoints: [{time: 0, joints: [0, 0]}]")},
     {"scenario.yaml:34:22: error: approach.waypoints[0].time is 0, must be greater than 0 [s]"}},
    {"waypoint_at_the_end",
     {with_approach("waypoints: [{time: 20, joints: [0, 0]}]")},
     {"scenario.yaml:34:22: error: approach.waypoints[0].time is 20 [s], must be less than 20, the approach's "
      "duration"}},
    {"waypoints_out_of_order",
     {with_approach("waypoints: [{time: 8, joints: [0, 0]}, {time: 8, joints: [0, 0]}, {time: 9, joints: [0, 0]}]")},
     {"scenario.yaml:34:49: error: approach.waypoints[1].time is 8 [s], must be greater than 8 of the waypoint "
      "before"}},
    {"waypoint_without_place",
     {with_approach("waypoints: [{time: 5}]")},
     {"scenario.yaml:34:15: error: missing key in approach.waypoints[0]: give 'joints' or 'end_effectors'"}},
    {"waypoint_with_two_places",
     {with_approach("waypoints: [{time: 5, joints: [0, 0], end_effectors: {tip: {position: [1, 0, 0]}}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:41: error: approach.waypoints[0] has both 'joints' and 'end_effectors', only one is allowed"}},
    {"waypoint_lacks_a_joint",
     {with_approach("waypoints: [{time: 5, joints: {elbow: 0}}]")},
     {"scenario.yaml:34:33: error: approach.waypoints[0].joints lacks joints: shoulder"}},
    {"waypoint_beyond_limits",
     {with_approach("waypoints: [{time: 5, joints: [3, 0], rates: {shoulder: 2}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:34: error: approach.waypoints[0].joints[0] (joint 'shoulder') is 3, beyond the joint's limits "
      "-2 to 2",
      "scenario.yaml:35:59: error: approach.waypoints[0].rates.shoulder is 2, beyond the joint's rate limit 1"}},
    {"waypoint_rates_of_a_place",
     {with_approach("waypoints: [{time: 5, rates: [0, 0], end_effectors: {tip: {position: [1, 0, 0]}}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:25: error: 'rates' needs 'joints' in approach.waypoints[0]"}},
    {"waypoint_with_rates_and_quartic",
     {with_approach(
         "waypoints: [{time: 5, joints: [0, 0], rates: [0, 0]}, {time: 6, joints: [0, 0], rates: {elbow: 0.1}}]")},
     {"scenario.yaml:31:3: error: approach.profile: the quartic profile starts from rest, and so cannot leave "
      "approach.waypoints[1], which is passed with rates; use quintic or cycloidal"}},
    {"waypoint_place_and_quartic",
     {{"  duration: 20", "  profile: quartic\n  duration: 20"},
      with_approach("waypoints: [{time: 5, end_effectors: {tip: {position: [1, 0, 0]}}}]")},
     {"scenario.yaml:31:12: error: approach.profile: the quartic profile starts from rest, and so cannot leave "
      "approach.waypoints[0], which is passed with rates; use quintic or cycloidal"}},
    {"waypoint_names_nobody",
     {with_approach("waypoints: [{time: 5, end_effectors: {}}]")},
     {"scenario.yaml:34:40: error: approach.waypoints[0].end_effectors is empty, must have at least one entry"}},
    {"waypoint_unknown_end_effector",
     {with_approach("waypoints: [{time: 5, end_effectors: {tipp: {position: [1, 0, 0]}}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:41: error: unknown end-effector 'tipp' in approach.waypoints[0].end_effectors; did you mean "
      "'tip'?"}},
    {"waypoint_unknown_target",
     {with_approach("waypoints: [{time: 5, end_effectors: {tip: {position: [1, 0, 0], target: bal}}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:76: error: unknown target 'bal' in approach.waypoints[0].end_effectors.tip; did you mean "
      "'ball'?"}},
    {"waypoint_place_without_position",
     {with_approach("waypoints: [{time: 5, end_effectors: {tip: {velocity: [1, 0, 0]}}}]"),
      {"  duration: 20", "  profile: quintic\n  duration: 20"}},
     {"scenario.yaml:35:46: error: missing key 'position' in approach.waypoints[0].end_effectors.tip"}},
    {"waypoint_in_the_straight_piece",
     {with_motion("plan: {}\n  straight_in: {stand_off: 0.1, duration: 4}\n  waypoints: [{time: 16, joints: [0, 0]}]"),
      with_tip("approach_axis: [1, 0, 0]"), with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:34:22: error: approach.waypoints[0].time is 16 [s], must be less than 16, where straight_in "
      "begins"}},
    {"straight_in_without_plan",
     {{"  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}",
       "  final_joints: [0.2, -0.4]\n  straight_in: {stand_off: 0.1, duration: 2}"},
      with_tip("approach_axis: [1, 0, 0]"),
      with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:33:3: error: 'straight_in' needs 'plan' in approach"}},
    {"straight_in_without_direction",
     {with_motion("plan: {}\n  straight_in: {stand_off: 0.1, duration: 2}")},
     {"scenario.yaml:33:3: error: approach.straight_in needs an 'approach_direction' at grasp point 'grip' of target "
      "'ball'"}},
    {"straight_in_with_rates",
     {with_motion("plan: {}\n  straight_in: {stand_off: 0.1, duration: 2}\n  final_rates: [0, 0]"),
      with_tip("approach_axis: [1, 0, 0]"), with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:34:3: error: 'final_rates' in approach has no meaning with straight_in: the rates follow from "
      "straight_in"}},
    {"straight_in_too_long",
     {with_motion("plan: {}\n  straight_in: {stand_off: 0.1, duration: 20}"), with_tip("approach_axis: [1, 0, 0]"),
      with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:33:43: error: approach.straight_in.duration is 20 [s], must be less than the approach's 20"}},
    {"straight_in_out_of_range",
     {with_motion("plan: {}\n  straight_in: {stand_off: 0, duration: 0, final_speed: -1}"),
      with_tip("approach_axis: [1, 0, 0]"), with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:33:28: error: approach.straight_in.stand_off is 0, must be greater than 0 [m]",
      "scenario.yaml:33:41: error: approach.straight_in.duration is 0, must be greater than 0 [s]",
      "scenario.yaml:33:57: error: approach.straight_in.final_speed is -1, must be at least 0 [m/s]"}},
    {"straight_in_lacks_all",
     {with_motion("plan: {}\n  straight_in: {}"), with_tip("approach_axis: [1, 0, 0]"),
      with_point("approach_direction: [0, -1, 0]")},
     {"scenario.yaml:33:16: error: missing key 'stand_off' in approach.straight_in",
      "scenario.yaml:33:16: error: missing key 'duration' in approach.straight_in"}},
    {"computed_torque_without_gains",
     {with_approach("tracking: {mode: computed_torque, kp: 1}")},
     {"scenario.yaml:34:13: error: missing key 'kd' in approach.tracking, needed with mode: computed_torque"}},
    {"noise_without_size",
     {with_approach("tracking: {mode: pd, kp: 1, kd: 1, noise: {bandwidth: 0}}")},
     {"scenario.yaml:34:45: error: missing key 'position' in approach.tracking.noise",
      "scenario.yaml:34:57: error: approach.tracking.noise.bandwidth is 0, must be greater than 0 [Hz]"}},
    {"noise_out_of_range",
     {with_approach("tracking: {mode: pd, kp: 1, kd: 1, noise: {position: -1, seed: 1.5}}")},
     {"scenario.yaml:34:56: error: approach.tracking.noise.position is -1, must be at least 0 [rad or m]",
      "scenario.yaml:34:66: error: approach.tracking.noise.seed must be a whole number, not 1.5"}},
    {"base_control_of_a_held_base",
     {{"base: {mass: 100,", "base: {mode: held, mass: 100,"}, with_approach("base_control: {kp: 1, kd: 1}")},
     {"scenario.yaml:34:3: error: approach.base_control: the robot's base is held, so its attitude needs no control"}},
    {"base_control_of_a_fixed_base",
     {{"base: {mass: 100,", "base: {mode: fixed, mass: 100,"},
      with_approach("base_control: {kp: 1, kd: 1}"),
      with_post_impact("base_control: {kp: 1, kd: 1}")},
     {"scenario.yaml:34:3: error: approach.base_control: the robot's base is fixed, so its attitude needs no control",
      "scenario.yaml:36:29: error: post_impact.base_control: the robot's base is fixed, so its attitude needs no "
      "control"}},
    {"wheels_that_are_not_there",
     {with_approach("base_control: {kp: 1, kd: 1, actuators: wheels}")},
     {"scenario.yaml:34:43: error: approach.base_control.actuators: wheels, but the robot has none (wheels: [...] in "
      "the robot file)"}},
    {"wheels_that_cannot_turn_the_base",
     {{"base: {mass: 100,", "wheels: [{name: a, axis: [0, 0, 1], inertia: 0.1}]\n  base: {mass: 100,"},
      with_approach("base_control: {kp: 0, kd: [0, 1, 1]}")},
     {"scenario.yaml:35:17: error: approach.base_control: its gains require torque about y, which the robot's wheels "
      "cannot give; state the gains per axis, with 0 for axes without control, or actuators: outside"}},
    {"wheels_of_no_use",
     {{"base: {mass: 100,",
       "wheels: [{name: a, axis: [0, 0, 2], inertia: 0}, {name: a, axis: [0, 0, 1], inertia: 1, rate: 0}]\n  base: "
       "{mass: 100,"}},
     {"scenario.yaml:4:28: error: robot.wheels[0].axis has length 2, must be a unit vector; normalised it is [0, 0, 1]",
      "scenario.yaml:4:48: error: robot.wheels[0].inertia is 0, must be greater than 0 [kg m^2]",
      "scenario.yaml:4:59: error: duplicate name 'a' in robot.wheels[1]: wheel names must be unique; first given in "
      "line "
      "4",
      "scenario.yaml:4:97: error: robot.wheels[1].rate is 0, must be greater than 0 [rad/s]"}},
    {"wheels_heavier_than_the_base",
     {{"base: {mass: 100,", "wheels: [{name: a, axis: [0, 0, 1], inertia: 1e3}]\n  base: {mass: 100,"}},
     {"scenario.yaml:4:11: error: robot.wheels: the base's inertia without its wheels, which it includes, is not that "
      "of a rigid body: inertia is not positive definite (principal moments -990, -490, -490)"}},
    {"base_control_without_gains",
     {with_post_impact("base_control: {kp: 1}")},
     {"scenario.yaml:35:43: error: missing key 'kd' in post_impact.base_control"}},
    {"base_control_gains",
     {with_approach("base_control: {kp: -1, kd: [1, 2], limit: [1, 0, 1]}")},
     {"scenario.yaml:34:22: error: approach.base_control.kp is -1, must be at least 0 [N m/rad]",
      "scenario.yaml:34:30: error: approach.base_control.kd has 2 items, must have exactly 3",
      "scenario.yaml:34:49: error: approach.base_control.limit[1] is 0, must be greater than 0 [N m]"}},
    {"base_control_gain_of_wrong_type",
     {with_approach("base_control: {kp: {x: 1}, kd: high, limit: 0}")},
     {"scenario.yaml:34:22: error: approach.base_control.kp must be a number for all axes or a list of 3 numbers [N "
      "m/rad], not a mapping",
      "scenario.yaml:34:34: error: approach.base_control.kd must be a number for all axes or a list of 3 numbers [N m "
      "s/rad], not the text 'high'",
      "scenario.yaml:34:47: error: approach.base_control.limit is 0, must be greater than 0 [N m]"}},
    {"base_control_with_two_attitudes",
     {with_approach("base_control: {kp: 1, kd: 1, rpy: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0]}")},
     {"scenario.yaml:34:48: error: approach.base_control has both 'quaternion_wxyz' and 'rpy', only one is allowed"}},
    {"base_control_quaternion",
     {with_approach("base_control: {kp: 1, kd: 1, quaternion_wxyz: [2, 0, 0, 0]}")},
     {"scenario.yaml:34:49: error: approach.base_control.quaternion_wxyz has length 2, must be 1 within 1e-6; "
      "normalised it is [1, 0, 0, 0]"}},
    {"capture_at_envelope_without_one",
     {with_approach("capture_at: envelope")},
     {"scenario.yaml:34:15: error: approach.capture_at: envelope needs an 'envelope' at end-effector 'tip'"}},
    {"capture_at_envelope_without_grasps",
     {{"  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}",
       "  final_joints: [0.2, -0.4]\n  capture_at: envelope"},
      {"grasps:\n  - {end_effector: tip, target: ball, point: grip}\n", ""},
      {"targets:\n  - name: ball\n    mass: 10\n    inertia: [1, 1, 1]\n    state: {position: [2, 0, 0], "
       "angular_velocity: [0, 0, 0.2]}\n    grasp_points:\n      - {name: grip, position: [0, 0.5, 0]}\n",
       ""},
      {"\nimpact: {duration: 1e-3}\npost_impact: {duration: 10}", ""}},
     {"scenario.yaml:24:15: error: approach.capture_at: envelope needs 'grasps': there is no point to close on"}},
    {"trajectory_with_redundant_keys",
     {with_motion(
         "trajectory: no.csv\n  profile: quintic\n  waypoints: []\n  final_rates: [0, 0]\n  straight_in: {stand_off: "
         "1, duration: 1}")},
     {"scenario.yaml:32:15: error: cannot read the file 'no.csv': no such file",
      "scenario.yaml:33:3: error: 'profile' in approach has no meaning with trajectory: the file gives the joint "
      "values at all times",
      "scenario.yaml:34:3: error: 'waypoints' in approach has no meaning with trajectory: the file gives the joint "
      "values at all times",
      "scenario.yaml:35:3: error: 'final_rates' in approach has no meaning with trajectory: the rates at the end "
      "follow from the file",
      "scenario.yaml:35:3: error: 'final_rates' in approach has no meaning with straight_in: the rates follow from "
      "straight_in",
      "scenario.yaml:36:3: error: 'straight_in' needs 'plan' in approach",
      "scenario.yaml:36:3: error: approach.straight_in needs an 'approach_direction' at grasp point 'grip' of target "
      "'ball'"}},
    {"trajectory_missing",
     {with_motion("trajectory: no.csv")},
     {"scenario.yaml:32:15: error: cannot read the file 'no.csv': no such file"}},
    {"trajectory_of_wrong_type",
     {with_motion("trajectory: [1]")},
     {"scenario.yaml:32:15: error: approach.trajectory must be text, not a list"}},
};

INSTANTIATE_TEST_SUITE_P(Each, ApproachFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace approach_faults_test
}  // namespace grapnel::test
