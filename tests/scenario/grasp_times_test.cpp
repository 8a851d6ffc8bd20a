// Grasp times, releases, impact laws and loop closure: values of the keys, and input errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace grasp_times_test {

using testing::ElementsAre;
using testing::IsEmpty;
using Closes = GraspSetup::Closes;
using Loops = IntegrationSetup::Loops;

CaptureProblem load(const std::vector<Edit>& edits) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", edited(kSmallScenario, edits)));
}

// A second end-effector that can grasp the same ball, a third that does not, and the second's grasp, grasps[1].
Edit with_knee() {
  return {"    - {name: tip, link: lower, position: [1, 0, 0]}",
          "    - {name: tip, link: lower, position: [1, 0, 0]}\n    - {name: knee, link: upper, envelope: {position: "
          "0.1}}\n    - {name: camera, link: base}"};
}
Edit with_knee_grasp(const std::string& keys = "") {
  const std::string tip = "  - {end_effector: tip, target: ball, point: grip}\n";
  return {tip, tip + "  - {end_effector: knee, target: ball, point: grip" + (keys.empty() ? "" : ", " + keys) + "}\n"};
}
Edit with_impact(const std::string& keys) { return {"{duration: 1e-3}", "{" + keys + "}"}; }
Edit without_impact() { return {"impact: {duration: 1e-3}\npost_impact: {duration: 10}\n", ""}; }
Edit without_approach() {
  return {"approach:\n  duration: 20\n  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}\n", ""};
}

TEST(LoadGrasps, CloseTogetherByDefault) {
  const CaptureProblem p = load({});
  EXPECT_EQ(p.grasps[0].closes, Closes::together);
  EXPECT_EQ(p.grasps[0].closes, GraspSetup{}.closes);
  EXPECT_EQ(load({with_grasp("closes_on_arrival: false")}).grasps[0].closes, Closes::together);
  EXPECT_TRUE(p.post_impact->releases.empty());
  EXPECT_EQ(p.impact->law, ImpactSetup{}.law);
  EXPECT_EQ(p.integration.loops, IntegrationSetup{}.loops);
  EXPECT_EQ(p.integration.baumgarte_time, IntegrationSetup{}.baumgarte_time);
}

TEST(LoadGrasps, IndividualTimes) {
  const CaptureProblem p = load({with_knee(), with_knee_grasp("closes_at: 25.5")});
  EXPECT_EQ(p.grasps[0].closes, Closes::together);
  EXPECT_EQ(p.grasps[1].closes, Closes::at_time);
  EXPECT_EQ(p.grasps[1].closes_at, 25.5);
  EXPECT_EQ(load({with_knee(), with_knee_grasp("closes_on_arrival: true")}).grasps[1].closes, Closes::on_arrival);

  // An early time, the latest allowed time, and separate times for all grasps.
  EXPECT_EQ(load({with_grasp("closes_at: 1e-3")}).grasps[0].closes_at, 1e-3);
  EXPECT_EQ(load({with_grasp("closes_at: 30")}).grasps[0].closes_at, 30);
  const CaptureProblem all =
      load({with_knee(), with_knee_grasp("closes_on_arrival: true"), with_grasp("closes_at: 7")});
  EXPECT_EQ(all.grasps[0].closes, Closes::at_time);
  EXPECT_EQ(all.grasps[1].closes, Closes::on_arrival);

  // During an approach without a post-impact phase, and after an initial impact.
  EXPECT_EQ(load({with_grasp("closes_at: 20"), {"post_impact: {duration: 10}\n", ""}}).grasps[0].closes_at, 20);
  EXPECT_EQ(load({with_grasp("closes_at: 10"), without_approach()}).grasps[0].closes_at, 10);
}

TEST(LoadGrasps, LimitsAndLaterClosings) {
  const CaptureProblem p = load({with_tip("envelope: {position: 0.1}"),
                                 with_grasp("holds: {force: 0.2 kN, moment: 30}, closes_again_at: [22, 25], "
                                            "closes_again_on_arrival: true")});
  ASSERT_TRUE(p.grasps[0].holds);
  EXPECT_EQ(p.grasps[0].holds->force, 200);
  EXPECT_EQ(p.grasps[0].holds->moment, 30);
  EXPECT_EQ(p.grasps[0].holds->combined, GraspLimits::Combined::ellipsoid);
  EXPECT_THAT(p.grasps[0].closes_again_at, ElementsAre(22, 25));
  EXPECT_TRUE(p.grasps[0].closes_again_on_arrival);
  const CaptureProblem one = load({with_grasp("holds: {force: 5, combined: components}")});
  EXPECT_EQ(one.grasps[0].holds->combined, GraspLimits::Combined::components);
  EXPECT_EQ(one.grasps[0].holds->moment, GraspLimits::kNone);
  EXPECT_FALSE(load({}).grasps[0].holds);
  EXPECT_FALSE(one.grasps[0].holds->slips());
  const CaptureProblem slips = load({with_grasp(
      "holds: {force: 5, moment: 2, beyond: slips, kinetic_ratio: 0.5, lost_distance: 40 mm, lost_angle: 30 "
      "deg}")});
  EXPECT_TRUE(slips.grasps[0].holds->slips());
  EXPECT_EQ(slips.grasps[0].holds->kinetic_ratio, 0.5);
  EXPECT_DOUBLE_EQ(slips.grasps[0].holds->lost_distance, 0.04);
  EXPECT_DOUBLE_EQ(slips.grasps[0].holds->lost_angle, M_PI / 6);
}

TEST(LoadGrasps, EnvelopesOnlyOfGraspsThatWaitForEachOther) {
  const std::vector<Edit> edits{with_approach("capture_at: envelope"), with_knee(), with_knee_grasp()};
  std::vector<Edit> timed = edits;
  timed.push_back(with_grasp("closes_at: 25"));  // the tip has no envelope
  EXPECT_EQ(load(timed).approach->capture_at, ApproachSetup::CaptureAt::envelope);
  EXPECT_THAT(faults_of(edited(kSmallScenario, edits)),
              ElementsAre("scenario.yaml:37:15: error: approach.capture_at: envelope needs an 'envelope' at "
                          "end-effector 'tip'"));
}

TEST(LoadGrasps, Releases) {
  const CaptureProblem p =
      load({with_knee(), with_knee_grasp("closes_at: 22"),
            with_post_impact("release: [{after: 2.5, end_effectors: [knee, tip]}, {after: 9.5}]")});
  const auto& releases = p.post_impact->releases;
  ASSERT_EQ(releases.size(), 2u);
  EXPECT_EQ(releases[0].after, 2.5);
  EXPECT_THAT(releases[0].end_effectors, ElementsAre("knee", "tip"));
  EXPECT_EQ(releases[1].after, 9.5);
  EXPECT_THAT(releases[1].end_effectors, IsEmpty());
}

TEST(LoadGrasps, LawsAndLoops) {
  const CaptureProblem p = load({with_impact("law: as_published, duration: 2e-3"),
                                 with_top("integration: {loops: baumgarte, baumgarte_time: 0.25}")});
  EXPECT_EQ(p.impact->law, ImpactSetup::Law::as_published);
  EXPECT_EQ(p.impact->duration, 2e-3);
  EXPECT_EQ(p.integration.loops, Loops::baumgarte);
  EXPECT_EQ(p.integration.baumgarte_time, 0.25);
  const CaptureProblem absent = load({with_top("integration: {loops: baumgarte}")});
  EXPECT_EQ(absent.integration.baumgarte_time, IntegrationSetup{}.baumgarte_time);
  EXPECT_EQ(load({with_top("integration: {loops: acceleration}")}).integration.loops, Loops::acceleration);
  EXPECT_EQ(load({with_top("integration: {loops: projection}")}).integration.loops, Loops::projection);
}

// Several grasps of one target, with a post-impact phase and a moved target.
TEST(LoadGrasps, SharedTargets) {
  const CaptureProblem p = load({with_knee(), with_knee_grasp(), with_top("contact: {gap: translate_target}")});
  EXPECT_EQ(p.contact.gap, ContactSetup::Gap::translate_target);
  EXPECT_EQ(p.grasps.size(), 2u);
  EXPECT_TRUE(p.post_impact);
}

// The largest gap for a grasp without an envelope: a distance or any.
TEST(LoadGrasps, LargestGap) {
  EXPECT_FALSE(load({}).contact.largest_gap);
  EXPECT_EQ(load({with_top("contact: {largest_gap: 0.25}")}).contact.largest_gap, 0.25);
  EXPECT_EQ(load({with_top("contact: {largest_gap: any}")}).contact.largest_gap,
            std::numeric_limits<double>::infinity());
  for (const char* wrong : {"0", "-1", "all", "[1]"}) {
    const std::string faults = testing::PrintToString(
        faults_of(edited(kSmallScenario, {with_top(std::string("contact: {largest_gap: ") + wrong + "}")})));
    EXPECT_NE(faults.find("contact.largest_gap"), std::string::npos) << faults;
  }
}

class GraspFault : public testing::TestWithParam<FaultCase> {};

// Messages are part of the interface: they state the location, the value, the allowed values and a suggestion.
TEST_P(GraspFault, IsReportedWithItsPlace) {
  const FaultCase& fault = GetParam();
  EXPECT_EQ(faults_of(edited(kSmallScenario, fault.edits)), fault.faults);
}

const std::vector<FaultCase> kCases{
    {"holds_nothing",
     {with_grasp("holds: {combined: components}")},
     {"scenario.yaml:29:59: error: grasps[0].holds states no limit; add force or moment"}},
    {"holds_zero",
     {with_grasp("holds: {force: 0}")},
     {"scenario.yaml:29:67: error: grasps[0].holds.force is 0, must be greater than 0 [N]"}},
    {"slips_with_a_ratio_above_one",
     {with_grasp("holds: {force: 5, beyond: slips, kinetic_ratio: 1.5}")},
     {"scenario.yaml:29:100: error: grasps[0].holds.kinetic_ratio is 1.5, must be greater than 0 and at most 1 [1]"}},
    {"slips_without_beyond",
     {with_grasp("holds: {force: 5, kinetic_ratio: 0.5}")},
     {"scenario.yaml:29:85: error: grasps[0].holds.kinetic_ratio is for grasps that slip; add "
      "grasps[0].holds.beyond: slips"}},
    {"slips_with_separate_limits_without_projection",
     {with_grasp("holds: {force: 5, moment: 2, combined: components, beyond: slips}"),
      with_top("integration: {loops: baumgarte}")},
     {"scenario.yaml:29:111: error: grasps[0].holds.beyond: slips with one limit, or separate ones, needs "
      "integration.loops: projection"}},
    {"slips_with_fixed_steps",
     {with_grasp("holds: {force: 5, moment: 2, beyond: slips}"), with_top("integration: {method: rk4, step: 0.01}")},
     {"scenario.yaml:29:89: error: grasps[0].holds.beyond: slips does not support integration.method: rk4, whose fixed "
      "steps do not resolve the ends of a slip; use automatic"}},
    {"slips_out_without_a_limit",
     {with_grasp("holds: {force: 5, beyond: slips, lost_angle: 1}")},
     {"scenario.yaml:29:97: error: grasps[0].holds.lost_angle needs grasps[0].holds.moment: without a limit the moment "
      "does not slip"}},
    {"slips_as_a_point_with_a_moment",
     {with_grasp("model: point, holds: {force: 5, moment: 2, beyond: slips}")},
     {"scenario.yaml:29:92: error: grasps[0].holds.moment has no effect: a grasp of model point transmits no moment; "
      "leave it out"}},
    {"closes_again_before_the_end_of_the_approach",
     {with_grasp("closes_again_at: [15, 25, 25]")},
     {"scenario.yaml:29:70: error: grasps[0].closes_again_at[0] is 15 [s], must be greater than 20, the approach's end",
      "scenario.yaml:29:78: error: grasps[0].closes_again_at[2] is 25 [s], must be greater than 25, the time before"}},
    {"closes_again_after_the_run",
     {with_grasp("closes_again_at: [31]")},
     {"scenario.yaml:29:70: error: grasps[0].closes_again_at[0] is 31 [s], must be at most 30, the end of "
      "post_impact"}},
    {"returns_without_envelope",
     {with_grasp("closes_again_on_arrival: true")},
     {"scenario.yaml:29:77: error: grasps[0].closes_again_on_arrival needs an 'envelope' at end-effector 'tip'"}},
    {"as_published_closes_again",
     {with_grasp("closes_again_at: [25]"), with_impact("law: as_published")},
     {"scenario.yaml:34:15: error: impact.law: as_published is not defined for grasps[0], which does not close with "
      "the "
      "others; use plastic"}},
    {"closes_at_zero",
     {with_grasp("closes_at: 0")},
     {"scenario.yaml:29:63: error: grasps[0].closes_at is 0, must be greater than 0 [s]"}},
    {"closes_at_is_text",
     {with_approach("capture_at: envelope"), with_tip("envelope: {position: 1}"), with_grasp("closes_at: late")},
     {"scenario.yaml:29:63: error: grasps[0].closes_at must be a number [s], not the text 'late'",
      "scenario.yaml:34:15: error: approach.capture_at: envelope has no effect: every grasp has closes_at or "
      "closes_on_arrival; leave out capture_at"}},
    {"closes_at_after_the_end",
     {with_grasp("closes_at: 30.5")},
     {"scenario.yaml:29:63: error: grasps[0].closes_at is 30.5 [s], must be at most 30, the end of post_impact"}},
    {"closes_at_after_an_approach_with_nothing_behind",
     {with_grasp("closes_at: 25"), {"post_impact: {duration: 10}\n", ""}},
     {"scenario.yaml:29:63: error: grasps[0].closes_at is 25 [s], after the approach's end at 20; later closing needs "
      "'post_impact'"}},
    {"closes_at_with_no_time_at_all",
     {with_grasp("closes_at: 25"), without_approach(), {"post_impact: {duration: 10}\n", ""}},
     {"scenario.yaml:29:63: error: grasps[0].closes_at is 25 [s], but without an approach all grasps close at 0; later "
      "closing needs 'post_impact'"}},
    {"closes_at_without_impact",
     {with_grasp("closes_at: 10"), without_impact()},
     {"scenario.yaml:29:63: error: grasps[0].closes_at needs 'impact' in the scenario: without it no grasp closes"}},
    {"closes_at_next_to_other_faults",
     {with_grasp("closes_at: 99"), {"duration: 20", "duration: -20"}},
     {"scenario.yaml:31:13: error: approach.duration is -20, must be greater than 0 [s]"}},
    {"closes_at_and_on_arrival",
     {with_tip("envelope: {position: 0.1}"), with_grasp("closes_at: 10, closes_on_arrival: true")},
     {"scenario.yaml:29:67: error: grasps[0] has both 'closes_at' and 'closes_on_arrival', only one is allowed"}},
    {"closes_on_arrival_without_envelope",
     {with_grasp("closes_on_arrival: true")},
     {"scenario.yaml:29:71: error: grasps[0].closes_on_arrival needs an 'envelope' at end-effector 'tip'"}},
    {"closes_on_arrival_without_impact",
     {with_tip("envelope: {position: 0.1}"), with_grasp("closes_on_arrival: true"), without_impact()},
     {"scenario.yaml:29:71: error: grasps[0].closes_on_arrival needs 'impact' in the scenario: without it no grasp "
      "closes"}},
    {"closes_on_arrival_is_yes",
     {with_grasp("closes_on_arrival: yes")},
     {"scenario.yaml:29:71: error: grasps[0].closes_on_arrival must be true or false, not the text 'yes'"}},
    {"closes_misspelt",
     {with_grasp("close_at: 40")},
     {"scenario.yaml:29:52: error: unknown key 'close_at' in grasps[0]; did you mean 'closes_at'?",
      "scenario.yaml:29:62: error: grasps[0].closes_at is 40 [s], must be at most 30, the end of post_impact"}},
    {"nobody_waits_for_the_envelope",
     {with_approach("capture_at: envelope"), with_grasp("closes_at: 10")},
     {"scenario.yaml:34:15: error: approach.capture_at: envelope has no effect: every grasp has closes_at or "
      "closes_on_arrival; leave out capture_at"}},
    {"release_at_no_time",
     {with_post_impact("release: [{end_effectors: [tip]}, {after: 0}, {after: -1}]")},
     {"scenario.yaml:35:39: error: missing key 'after' in post_impact.release[0]",
      "scenario.yaml:35:71: error: post_impact.release[1].after is 0, must be greater than 0 [s]",
      "scenario.yaml:35:83: error: post_impact.release[2].after is -1, must be greater than 0 [s]"}},
    {"release_out_of_order_and_late",
     {with_post_impact("release: [{after: 5}, {after: 5}, {after: 10}, {after: 7}]")},
     {"scenario.yaml:35:59: error: post_impact.release[1].after is 5 [s], must be greater than 5 of the release before",
      "scenario.yaml:35:71: error: post_impact.release[2].after is 10 [s], must be less than 10, post_impact's "
      "duration",
      "scenario.yaml:35:84: error: post_impact.release[3].after is 7 [s], must be greater than 10 of the release "
      "before"}},
    {"release_of_unknown_names",
     {with_knee(), with_post_impact("release: [{after: 5, end_effectors: [tib, knee, camera]}]")},
     {"scenario.yaml:37:66: error: unknown end-effector 'tib' in post_impact.release[0].end_effectors; did you mean "
      "'tip'?",
      "scenario.yaml:37:71: error: end-effector 'knee' in post_impact.release[0].end_effectors grasps nothing; grasps "
      "are tip",
      "scenario.yaml:37:77: error: end-effector 'camera' in post_impact.release[0].end_effectors grasps nothing; "
      "grasps "
      "are tip"}},
    {"release_twice",
     {with_post_impact("release: [{after: 5, end_effectors: [tip, tip]}, {after: 6, end_effectors: [tip]}]")},
     {"scenario.yaml:35:71: error: post_impact.release[0].end_effectors names 'tip' twice",
      "scenario.yaml:35:105: error: end-effector 'tip' in post_impact.release[1].end_effectors is already released in "
      "post_impact.release[0]"}},
    {"release_before_it_closes",
     {with_grasp("closes_at: 25"), with_post_impact("release: [{after: 5, end_effectors: [tip]}]")},
     {"scenario.yaml:35:66: error: end-effector 'tip' in post_impact.release[0].end_effectors closes at 25 [s], must "
      "close before it releases at 25"}},
    {"release_empty",
     {with_post_impact("release: [{after: 5, end_effectors: []}, {after: 6, end_effectors: tip}, {}]")},
     {"scenario.yaml:35:65: error: post_impact.release[0].end_effectors has 0 items, must have at least 1",
      "scenario.yaml:35:96: error: post_impact.release[1].end_effectors must be a list of names, not the text 'tip'",
      "scenario.yaml:35:102: error: missing key 'after' in post_impact.release[2]"}},
    {"release_of_numbers",
     {with_post_impact("release: [{after: 5, end_effectors: [1, [tip]]}, 3]")},
     {"scenario.yaml:35:66: error: post_impact.release[0].end_effectors[0] must be text, not the number 1; put it in "
      "quotes: '1'",
      "scenario.yaml:35:69: error: post_impact.release[0].end_effectors[1] must be text, not a list",
      "scenario.yaml:35:78: error: post_impact.release[1] must be a mapping, not the number 3"}},
    {"release_unknown_key",
     {with_post_impact("release: [{after: 5, end_effector: [tip]}, {at: 6}]")},
     {"scenario.yaml:35:50: error: unknown key 'end_effector' in post_impact.release[0]; did you mean 'end_effectors'?",
      "scenario.yaml:35:72: error: missing key 'after' in post_impact.release[1]",
      "scenario.yaml:35:73: error: unknown key 'at' in post_impact.release[1]; allowed are after, end_effectors"}},
    {"release_is_a_mapping",
     {with_post_impact("release: {after: 5}")},
     {"scenario.yaml:35:38: error: post_impact.release must be a list, not a mapping"}},
    // Only the misspelt end-effector of the grasp is reported, not the release that refers to the correct name.
    {"release_of_a_misspelt_grasp",
     {{"end_effector: tip", "end_effector: tipp"}, with_post_impact("release: [{after: 5, end_effectors: [tip]}]")},
     {"scenario.yaml:29:20: error: unknown end-effector 'tipp' in grasps[0]; did you mean 'tip'?"}},
    {"law_unknown",
     {with_impact("law: published")},
     {"scenario.yaml:34:15: error: unknown value 'published' for impact.law; did you mean 'as_published'?"}},
    {"law_for_a_fixed_base",
     {with_impact("law: as_published"), {"base: {mass: 100,", "base: {mode: fixed, mass: 100,"}},
     {"scenario.yaml:34:15: error: impact.law: as_published is not defined for a robot whose base is fixed; use "
      "plastic"}},
    {"law_for_other_grasps",
     {with_impact("law: as_published"), with_knee(),
      with_knee_grasp("model: hinge, axis: [0, 0, 1], closes_on_arrival: true"),
      with_grasp("model: point, closes_at: 10")},
     {"scenario.yaml:37:15: error: impact.law: as_published is not defined for grasps[0], which is not rigid; use "
      "plastic",
      "scenario.yaml:37:15: error: impact.law: as_published is not defined for grasps[0], which does not close with "
      "the others; use plastic",
      "scenario.yaml:37:15: error: impact.law: as_published is not defined for grasps[1], which is not rigid; use "
      "plastic",
      "scenario.yaml:37:15: error: impact.law: as_published is not defined for grasps[1], which does not close with "
      "the others; use plastic"}},
    {"loops_unknown",
     {with_top("integration: {loops: projected}")},
     {"scenario.yaml:34:22: error: unknown value 'projected' for integration.loops; did you mean 'projection'?"}},
    {"baumgarte_time_zero",
     {with_top("integration: {loops: baumgarte, baumgarte_time: 0}")},
     {"scenario.yaml:34:49: error: integration.baumgarte_time is 0, must be greater than 0 [s]"}},
    {"baumgarte_time_alone",
     {with_top("integration: {baumgarte_time: 0.1}")},
     {"scenario.yaml:34:15: error: 'baumgarte_time' needs 'loops' in integration"}},
    {"baumgarte_time_for_others",
     {with_top("integration: {loops: projection, baumgarte_time: 0.1}")},
     {"scenario.yaml:34:34: error: 'baumgarte_time' in integration has no meaning with loops: projection: it is for "
      "baumgarte"}},
    {"several_at_once",
     {with_knee(), with_knee_grasp("closes_on_arrival: true, closes_at: 5"), with_grasp("closes_at: 40"),
      with_impact("law: as_published"), with_post_impact("release: [{after: 20, end_effectors: [camera]}]"),
      with_top("integration: {loops: acceleration, baumgarte_time: 1}")},
     {"scenario.yaml:31:63: error: grasps[0].closes_at is 40 [s], must be at most 30, the end of post_impact",
      "scenario.yaml:32:78: error: grasps[1] has both 'closes_at' and 'closes_on_arrival', only one is allowed",
      "scenario.yaml:37:36: error: 'baumgarte_time' in integration has no meaning with loops: acceleration: it is for "
      "baumgarte",
      "scenario.yaml:38:15: error: impact.law: as_published is not defined for grasps[0], which does not close with "
      "the others; use plastic",
      "scenario.yaml:38:15: error: impact.law: as_published is not defined for grasps[1], which does not close with "
      "the others; use plastic",
      "scenario.yaml:39:47: error: post_impact.release[0].after is 20 [s], must be less than 10, post_impact's "
      "duration",
      "scenario.yaml:39:67: error: end-effector 'camera' in post_impact.release[0].end_effectors grasps nothing; "
      "grasps "
      "are tip, knee"}},
};

INSTANTIATE_TEST_SUITE_P(Each, GraspFault, testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

// For overrides without a file location the message states the override.
TEST(GraspFaults, OfOverrides) {
  EXPECT_THAT(
      faults_of(kSmallScenario, std::vector<Override>{{"grasps.tip.closes_at", "31"}}),
      ElementsAre("--set grasps.tip.closes_at=31: error: grasps[0].closes_at is 31 [s], must be at most 30, the "
                  "end of post_impact"));
}

}  // namespace grasp_times_test
}  // namespace grapnel::test
