// Every kind of fault in what an impact asks for, one at a time: laws, contacts, compliance, arrival, ratings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace impact_faults_test {

class ImpactFault : public testing::TestWithParam<FaultCase> {};

TEST_P(ImpactFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

Edit impact(const std::string& keys) { return {"impact: {duration: 1e-3}", "impact: {" + keys + "}"}; }
// A contact on a sphere, whose surface is known.
Edit on_sphere() { return {"    grasp_points", "    geometry: {shape: sphere, radius: 0.5}\n    grasp_points"}; }
const std::string kGrasp = "grasp: {linear_stiffness: 1e5, angular_stiffness: 1e3}";

const std::vector<FaultCase> kCases{
    // --- Accepted ---
    {"bilateral_accepted", {impact("law: bilateral_restitution, restitution: {linear: 0.5, angular: 0.1}")}, {}},
    {"friction_accepted",
     {impact("law: friction, friction: 0.3, restitution: 0.5, hypothesis: newton, joints: braked"),
      with_grasp("model: contact"), on_sphere()},
     {}},
    {"compliant_accepted", {impact("law: compliant, longest: 0.5, settled: 1e-6, " + kGrasp)}, {}},
    {"compliant_contact_accepted",
     {impact("law: compliant, friction: 0.2, contact: {model: hunt_crossley, stiffness: 1e6, damping: 0.3, exponent: "
             "1.5, slip_speed: 1e-3}"),
      with_grasp("model: contact"), with_point("normal: [0, 1, 0]")},
     {}},
    {"arrival_accepted", {with_grasp("relative_velocity: [0.01, 0, 0]")}, {}},
    // --- The law and its keys ---
    {"law_unknown",
     {impact("law: elastic, friction: 0.1")},
     {"scenario.yaml:34:15: error: unknown value 'elastic' for impact.law; did you mean 'plastic'?"}},
    {"restitution_of_plastic",
     {impact("restitution: 0.5")},
     {"scenario.yaml:34:10: error: impact.restitution has no meaning with law plastic; it belongs to "
      "bilateral_restitution, restitution, friction"}},
    {"hypothesis_of_bilateral",
     {impact("law: bilateral_restitution, hypothesis: newton")},
     {"scenario.yaml:34:38: error: impact.hypothesis has no meaning with law bilateral_restitution; it belongs to "
      "restitution, friction"}},
    {"friction_of_restitution",
     {impact("law: restitution, friction: 0.5"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:28: error: impact.friction has no meaning with law restitution; it belongs to friction, "
      "compliant"}},
    {"compliance_of_plastic",
     {impact("contact: {stiffness: 1}, " + kGrasp + ", longest: 1, settled: 1e-3")},
     {"scenario.yaml:34:10: error: impact.contact has no meaning with law plastic; it belongs to compliant",
      "scenario.yaml:34:35: error: impact.grasp has no meaning with law plastic; it belongs to compliant",
      "scenario.yaml:34:91: error: impact.longest has no meaning with law plastic; it belongs to compliant",
      "scenario.yaml:34:103: error: impact.settled has no meaning with law plastic; it belongs to compliant"}},
    {"joints_of_as_published",
     {impact("law: as_published, joints: free")},
     {"scenario.yaml:34:29: error: impact.joints has no meaning with law as_published; it belongs to plastic, "
      "bilateral_restitution, restitution, friction, compliant"}},
    {"joints_unknown",
     {impact("joints: locked")},
     {"scenario.yaml:34:18: error: unknown value 'locked' for impact.joints; allowed are free, braked, driven, "
      "impedance"}},
    {"hypothesis_unknown",
     {impact("law: friction, hypothesis: strong"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:37: error: unknown value 'strong' for impact.hypothesis; did you mean 'stronge'?"}},
    {"key_unknown",
     {impact("law: friction, restituton: 0.5"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:25: error: unknown key 'restituton' in impact; did you mean 'restitution'?"}},
    {"restitution_above_one",
     {impact("law: restitution, restitution: 1.2"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:41: error: impact.restitution is 1.2, must be between 0 and 1"}},
    {"restitution_linear_negative",
     {impact("law: bilateral_restitution, restitution: {linear: -0.1}")},
     {"scenario.yaml:34:60: error: impact.restitution.linear is -0.1, must be between 0 and 1"}},
    {"restitution_unknown_key",
     {impact("law: bilateral_restitution, restitution: {liner: 0.1}")},
     {"scenario.yaml:34:52: error: unknown key 'liner' in impact.restitution; did you mean 'linear'?"}},
    {"restitution_angular_of_contact",
     {impact("law: restitution, restitution: {linear: 0.5, angular: 0.5}"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:55: error: impact.restitution.angular belongs to law bilateral_restitution: a contact "
      "transmits no moment"}},
    {"friction_negative",
     {impact("law: friction, friction: -0.1"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:35: error: impact.friction is -0.1, must be at least 0"}},
    // --- Contacts ---
    {"contact_of_plastic",
     {with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:30:59: error: grasps[0].model: contact is not supported by impact.law plastic; use restitution, "
      "friction or compliant, or a grasp that holds (rigid, hinge, point)"}},
    {"contact_of_as_published",
     {impact("law: as_published"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:30:59: error: grasps[0].model: contact is not supported by impact.law as_published; use "
      "restitution, friction or compliant, or a grasp that holds (rigid, hinge, point)"}},
    {"contact_without_normal",
     {impact("law: friction"), with_grasp("model: contact")},
     {"scenario.yaml:29:59: error: grasps[0].model: contact needs the surface's normal: state for grasp point 'grip' "
      "of "
      "target 'ball' a normal, or an approach_direction (the normal is opposite to it)"}},
    {"friction_of_grasps_only",
     {impact("law: friction")},
     {"scenario.yaml:34:15: error: impact.law: friction is for contacts, but every grasp holds; state model: contact "
      "for a grasp, or use law bilateral_restitution or plastic"}},
    {"normal_not_unit",
     {with_point("normal: [0, 2, 0]")},
     {"scenario.yaml:27:53: error: targets[0].grasp_points[0].normal has length 2, must be a unit vector; normalised "
      "it is [0, 1, 0]"}},
    // --- Compliance ---
    {"compliant_without_grasp",
     {impact("law: compliant")},
     {"scenario.yaml:34:15: error: impact.law: compliant needs impact.grasp with the stiffness of the grasps"}},
    {"compliant_without_contact",
     {impact("law: compliant, " + kGrasp), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:15: error: impact.law: compliant needs impact.contact with the stiffness of the contacts"}},
    {"grasp_without_angular_stiffness",
     {impact("law: compliant, grasp: {linear_stiffness: 1e5}")},
     {"scenario.yaml:34:26: error: missing key 'angular_stiffness' in impact.grasp: rigid grasps and hinges hold "
      "rotations too"}},
    {"grasp_without_linear_stiffness",
     {impact("law: compliant, grasp: {angular_stiffness: 1e5}")},
     {"scenario.yaml:34:33: error: missing key 'linear_stiffness' in impact.grasp"}},
    {"grasp_of_point_needs_no_angular_stiffness",
     {impact("law: compliant, grasp: {linear_stiffness: 1e5}"), with_grasp("model: point")},
     {}},
    {"stiffness_zero",
     {impact("law: compliant, grasp: {linear_stiffness: 0, angular_stiffness: -1, linear_damping: -1, "
             "angular_damping: -2}")},
     {"scenario.yaml:34:52: error: impact.grasp.linear_stiffness is 0, must be greater than 0 [N/m]",
      "scenario.yaml:34:74: error: impact.grasp.angular_stiffness is -1, must be greater than 0 [N m/rad]",
      "scenario.yaml:34:94: error: impact.grasp.linear_damping is -1, must be at least 0 [N s/m]",
      "scenario.yaml:34:115: error: impact.grasp.angular_damping is -2, must be at least 0 [N m s/rad]"}},
    {"contact_ranges",
     {impact("law: compliant, contact: {model: herz, stiffness: -1, damping: -1, exponent: 0.5, slip_speed: 0}"),
      with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:43: error: unknown value 'herz' for impact.contact.model; did you mean 'hertz'?",
      "scenario.yaml:35:60: error: impact.contact.stiffness is -1, must be greater than 0 [N/m, N/m^1.5 or N/m^n]",
      "scenario.yaml:35:73: error: impact.contact.damping is -1, must be at least 0 [N s/m, or s/m]",
      "scenario.yaml:35:87: error: impact.contact.exponent is 0.5, must be between 1 and 5",
      "scenario.yaml:35:104: error: impact.contact.slip_speed is 0, must be greater than 0 [m/s]"}},
    {"contact_without_stiffness",
     {impact("law: compliant, contact: {}"), with_grasp("model: contact"), on_sphere()},
     {"scenario.yaml:35:35: error: missing key 'stiffness' in impact.contact"}},
    {"longest_and_settled",
     {impact("law: compliant, longest: 0, settled: 0.5, " + kGrasp)},
     {"scenario.yaml:34:35: error: impact.longest is 0, must be greater than 0 [s]",
      "scenario.yaml:34:47: error: impact.settled is 0.5, must be greater than 0 and at most 0.1"}},
    // --- Arrival ---
    {"arrival_without_approach",
     {{"approach:\n  duration: 20\n  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}\n", ""},
      with_grasp("relative_velocity: [0.1, 0, 0]")},
     {"scenario.yaml:29:52: error: grasps[0].relative_velocity: there is no approach; without one, relative motion "
      "follows from the initial state and the target's"}},
    {"arrival_straight_in",
     {way("plan: {}\n  straight_in: {stand_off: 0.1, duration: 2}"), with_point("approach_direction: [0, -1, 0]"),
      with_tip("approach_axis: [1, 0, 0]"), with_grasp("relative_velocity: [0.1, 0, 0]")},
     {"scenario.yaml:29:52: error: grasps[0].relative_velocity: approach.straight_in determines the velocity at "
      "arrival; use its final_speed"}},
    {"arrival_with_given_rates",
     {{"final_rates: {match: velocity}", "final_rates: [0, 0]"}, with_grasp("relative_velocity: [0.1, 0, 0]")},
     {"scenario.yaml:29:52: error: grasps[0].relative_velocity: the final rates are given, so no velocity is matched; "
      "use approach.final_rates: {match: ...}"}},
    {"arrival_with_zero_rates",
     {{"  final_rates: {match: velocity}\n", ""}, with_grasp("relative_velocity: [0.1, 0, 0]")},
     {"scenario.yaml:29:52: error: grasps[0].relative_velocity: the final rates are given, so no velocity is matched; "
      "use approach.final_rates: {match: ...}"}},
    {"arrival_turning_with_velocity",
     {with_grasp("relative_angular_velocity: [0, 0, 0.1]")},
     {"scenario.yaml:29:52: error: grasps[0].relative_angular_velocity: the angular velocity is not matched; use "
      "approach.final_rates: {match: twist}"}},
    {"arrival_of_two",
     {with_grasp("relative_velocity: [0.1, 0]")},
     {"scenario.yaml:29:71: error: grasps[0].relative_velocity has 2 items, must have exactly 3"}},
    // --- Ratings ---
    {"gripper_rating_drives_nothing",
     {with_tip("rating: {driving: 5}")},
     {"scenario.yaml:18:62: error: unknown key 'driving' in robot.end_effectors[0].rating; allowed are force, moment, "
      "impulse, angular_impulse"}},
    {"gripper_rating_empty",
     {with_tip("rating: {}")},
     {"scenario.yaml:18:61: error: robot.end_effectors[0].rating is empty, must have at least one of force, moment, "
      "impulse, angular_impulse"}},
    {"joint_rating_zero",
     {{"limits: {lower: -2, upper: 2, rate: 1}", "rating: {force: 0, driving: 5}"}},
     {"scenario.yaml:8:80: error: robot.links[0].joint.rating.force is 0, must be greater than 0 [N]"}},
    {"joint_rating_of_fixed",
     {{"joint: {name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [1, 0, 0]}}",
       "joint: {name: elbow, type: fixed, rating: {driving: 1, force: 2}}"},
      {"joints: {shoulder: 0.5, elbow: 1}", "joints: {shoulder: 0.5}"},
      {"final_joints: [0.2, -0.4]", "final_joints: [0.2]"}},
     {"scenario.yaml:14:50: error: 'driving' in robot.links[1].joint.rating has no meaning with type: fixed"}},
};

INSTANTIATE_TEST_SUITE_P(Cases, ImpactFault, testing::ValuesIn(kCases),
                         [](const auto& test) { return test.param.name; });

}  // namespace impact_faults_test
}  // namespace grapnel::test
