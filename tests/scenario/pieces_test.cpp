// Approaches stated piece by piece: what they become, and every kind of fault in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/scenario/problem_setter.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace pieces_test {

using testing::ElementsAre;

// Start where kSmallScenario does. For the elbow a parabola and the line that continues it.
const char* const kPieces =
    "pieces:\n"
    "    - {until: 8, series: [[0.5], [1.5, 1, 0.5]]}\n"
    "    - until: 20\n"
    "      series: {elbow: [7.5, 4.5], shoulder: [0.5]}";
const Edit kPath = way(kPieces);
const Edit kNoDuration{"  duration: 20\n", ""};
const Edit kNoJoints{"  joints: {shoulder: 0.5, elbow: 1}", "  base: {}"};

class Pieces : public testing::Test {
 protected:
  CaptureProblem load(const std::vector<Edit>& edits) const {
    return load_scenario(folder_.write("scenario.yaml", edited(kSmallScenario, edits)));
  }
  static std::vector<std::string> faults(const std::vector<Edit>& edits) {
    return faults_of(edited(kSmallScenario, edits));
  }
  static std::vector<std::string> faults(const std::string& pieces) { return faults({way(pieces)}); }
  TemporaryFolder folder_;
};

TEST_F(Pieces, InJointOrder) {
  const CaptureProblem p = load({kPath});
  const ApproachSetup& a = *p.approach;
  ASSERT_EQ(a.pieces.size(), 2u);
  EXPECT_EQ(a.pieces[0].until, 8);
  EXPECT_EQ(a.pieces[1].until, 20);
  EXPECT_THAT(a.pieces[0].series, ElementsAre(ElementsAre(0.5), ElementsAre(1.5, 1, 0.5)));
  EXPECT_THAT(a.pieces[1].series, ElementsAre(ElementsAre(0.5), ElementsAre(7.5, 4.5)));
  EXPECT_EQ(a.duration, 20);
  EXPECT_TRUE(a.final_position.empty());
  EXPECT_FALSE(a.plan);
  EXPECT_FALSE(a.sampled);
  EXPECT_FALSE(a.match);
  EXPECT_FALSE(a.final_rates);
  EXPECT_THAT(p.joint_position, ElementsAre(0.5, 1));
  EXPECT_THAT(p.joint_rate, ElementsAre(0, -0.25));
}

TEST_F(Pieces, SayDurationAndInitialValues) {
  const CaptureProblem p = load({kPath, kNoDuration, kNoJoints});
  EXPECT_TRUE(problem_bytes(p) == problem_bytes(load({kPath})));
  EXPECT_THAT(faults({kPath, {"elbow: 1}", "elbow: 1.1}"}, {"duration: 20", "duration: 19"}}),
              ElementsAre("scenario.yaml:20:34: error: initial.joints.elbow is 1.1, but the pieces start at 1; they "
                          "must agree within 1e-06 or leave out initial.joints",
                          "scenario.yaml:31:13: error: approach.duration is 19 [s], but the pieces end at 20; make "
                          "them agree or leave out the duration"));
  const Edit rates{"  joints: {", "  joint_rates: {elbow: 0.5}\n  joints: {"};
  EXPECT_THAT(faults({kPath, rates}),
              ElementsAre("scenario.yaml:20:24: error: initial.joint_rates.elbow is 0.5, but the pieces start with "
                          "-0.25; they must agree within 1e-06 or leave out initial.joint_rates"));
  const Edit pd = with_approach("tracking: {mode: pd, kp: 1, kd: 1}");
  EXPECT_THAT(load({kPath, rates, pd}).joint_rate, ElementsAre(0, 0.5));
}

TEST_F(Pieces, TimesAndMeetings) {
  EXPECT_THAT(
      faults("pieces:\n    - {until: 8, series: [[0.5], [1]]}\n    - {until: 7, series: [[0.5], [1]]}\n"
             "    - {until: 0, series: [[0.5], [1]]}"),
      ElementsAre("scenario.yaml:34:15: error: approach.pieces[1].until is 7 [s], must be greater than 8 of the "
                  "piece before",
                  "scenario.yaml:35:15: error: approach.pieces[2].until is 0, must be greater than 0 [s]"));
  EXPECT_THAT(faults("pieces:\n    - {until: 8, series: [[0.5], [1]]}\n    - {until: 20, series: [[0.6], [2, 1]]}"),
              ElementsAre("scenario.yaml:34:28: error: approach.pieces[1].series of joint 'shoulder' begins at 0.6, "
                          "but the previous piece ends at 0.5; they must agree within 1e-06",
                          "scenario.yaml:34:35: error: approach.pieces[1].series of joint 'elbow' begins with the rate "
                          "0.16666666666666666, but the previous piece ends with the rate 0; they must agree within "
                          "1e-06"));
  EXPECT_THAT(faults("pieces: [{until: 1e-200, series: [[0.5, 1e200, -1e200], [1]]}]"),
              testing::Contains("scenario.yaml:32:37: error: approach.pieces[0].series of joint 'shoulder' gives "
                                "positions or rates that overflow"));
}

TEST_F(Pieces, JointsAndCoefficients) {
  EXPECT_THAT(faults("pieces: [{until: 20, series: [[0.5]]}]"),
              ElementsAre("scenario.yaml:32:32: error: approach.pieces[0].series has 1 item, must have 2, one for each "
                          "moving joint: shoulder, elbow"));
  EXPECT_THAT(faults("pieces: [{until: 20, series: {shoulder: [0.5], elbo: [1]}}]"),
              ElementsAre("scenario.yaml:32:50: error: unknown joint 'elbo' in approach.pieces[0].series; did you mean "
                          "'elbow'?"));
  EXPECT_THAT(faults("pieces: [{until: 20, series: {shoulder: [0.5]}}]"),
              ElementsAre("scenario.yaml:32:32: error: approach.pieces[0].series lacks joints: elbow"));
  EXPECT_THAT(
      faults("pieces: [{until: 20, series: [[0.5], []]}]"),
      ElementsAre("scenario.yaml:32:40: error: approach.pieces[0].series[1] has 0 items, must have at least 1"));
  EXPECT_THAT(
      faults("pieces: [{until: 20, series: [[0.5, .inf], 1]}]"),
      ElementsAre("scenario.yaml:32:39: error: approach.pieces[0].series[0][1] is .inf, must be a finite number "
                  "[rad or m]",
                  "scenario.yaml:32:46: error: approach.pieces[0].series[1] must be a list [rad or m], not the "
                  "number 1"));
  EXPECT_THAT(faults("pieces: []"),
              ElementsAre("scenario.yaml:32:11: error: approach.pieces has 0 items, must have at least 1"));
}

TEST_F(Pieces, SayItAll) {
  EXPECT_THAT(faults(std::string(kPieces) +
                     "\n  profile: quintic\n  waypoints: []\n  final_rates: [0, 0]\n  final_joints: [0, 0]"),
              ElementsAre("scenario.yaml:36:3: error: 'profile' in approach has no meaning with pieces: they give the "
                          "joint values at all times",
                          "scenario.yaml:37:3: error: 'waypoints' in approach has no meaning with pieces: they give "
                          "the joint values at all times",
                          "scenario.yaml:38:3: error: 'final_rates' in approach has no meaning with pieces: the rates "
                          "at the end follow from them",
                          "scenario.yaml:39:3: error: approach has both 'pieces' and 'final_joints', only one is "
                          "allowed"));
  EXPECT_THAT(faults({kPath, with_approach("straight_in: {stand_off: 1, duration: 1}"),
                      with_point("approach_direction: [1, 0, 0]"), with_tip("approach_axis: [1, 0, 0]")}),
              ElementsAre("scenario.yaml:36:3: error: 'straight_in' needs 'plan' in approach"));
  EXPECT_THAT(faults({kPath, with_grasp("relative_velocity: [0.1, 0, 0]")}),
              ElementsAre("scenario.yaml:29:52: error: grasps[0].relative_velocity: the final rates are given, so no "
                          "velocity is matched; use approach.final_rates: {match: ...}"));
}

TEST_F(Pieces, ChangedByAPath) {
  const std::filesystem::path file = folder_.write("scenario.yaml", edited(kSmallScenario, {kPath, kNoDuration}));
  const CaptureProblem p =
      load_scenario(file, std::vector<Override>{{"approach.pieces[1].until", "20"},
                                                {"approach.pieces[1].series.shoulder[0]", "0.5"},
                                                {"approach.pieces[0].series[1]", "[1.5, 1, 0.5]"}});
  EXPECT_TRUE(problem_bytes(p) == problem_bytes(load({kPath})));
}

TEST_F(Pieces, DocumentedExample) {
  const std::string page = bytes_of(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "docs/formats/scenario.md");
  const std::string fence = "```yaml\n";
  const std::size_t begin = page.find(fence, page.find("### `pieces[]`")) + fence.size();
  std::string example = page.substr(begin, page.find("```", begin) - begin);
  const std::string head = "approach:\n  ";
  ASSERT_EQ(example.substr(0, head.size()), head);
  example = example.substr(head.size(), example.size() - head.size() - 1);
  EXPECT_EQ(load({way(example), kNoDuration}).approach->pieces.size(), 2u);
}

}  // namespace pieces_test
}  // namespace grapnel::test
