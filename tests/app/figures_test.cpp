// The command `grapnel figure` for campaigns, maps and complete captures; names that need gnuplot quoting.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "program_run.hpp"

namespace grapnel {
namespace figures_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;
using testing::Not;

class Figures : public test::ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    std::string text = read_text(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-at-contact.yaml");
    text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
    write("quick.yaml", text);
  }
  // The SVG figure `what` of a results folder.
  std::string drawn(const std::string& folder, const std::string& what, const std::string& more = "") const {
    const Outcome o = run("figure " + folder + " --what " + what + " -o f/" + what + ".svg " + more);
    EXPECT_EQ(o.code, 0) << what << "\n" << o.err;
    return read_text(folder_ / "f" / (what + ".svg"));
  }
};

TEST_F(Figures, CampaignCriteriaAndDistributions) {
  write("c.yaml",
        "schema: grapnel-campaign/1\nname: a\nscenario: quick.yaml\nsimulate: impact\ncases: 40\nseed: 1\n"
        "success: [{name: \"soft, isn''t it\", holds: \"grasps/tip-1/impulse_magnitude <= 0.7\"}]\n"
        "uncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.5, to: 1.5}}]\n");
  ASSERT_EQ(run("campaign c.yaml -o r --quiet --no-report").code, 0);
  const Outcome list = run("figure r --list");
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_THAT(list.out, HasSubstr("criteria "));
  EXPECT_THAT(list.out, HasSubstr("distribution "));
  EXPECT_THAT(drawn("r", "criteria"), HasSubstr("soft, isn''t it"));
  EXPECT_THAT(drawn("r", "distribution"), HasSubstr("impulse_magnitude"));
  EXPECT_THAT(drawn("r", "distribution", "--column 'targets[0].mass'"), HasSubstr("targets[0].mass"));
  const Outcome unknown = run("figure r --what distribution --column nothing");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("the campaign has no column or input 'nothing'; it has: "));
  EXPECT_THAT(run("figure r --what joints").err, HasSubstr("has no figure 'joints'; it has: "));
}

TEST_F(Figures, MapProbabilityOverDesign) {
  write("m.yaml",
        "schema: grapnel-campaign/1\nname: map\nscenario: quick.yaml\nsimulate: impact\ncases: 5\nseed: 1\n"
        "design:\n  - {path: \"targets[0].mass\", values: [5, 10, 15]}\n"
        "  - {path: \"targets[0].state.velocity[0]\", values: [0, 0.1, 0.2, 0.3]}\n"
        "uncertain: [{path: \"targets[0].inertia\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n"
        "success: [\"grasps/tip-1/impulse_magnitude <= 1\"]\n");
  ASSERT_EQ(run("map m.yaml -o r --quiet --no-report").code, 0);
  EXPECT_THAT(run("figure r --list").out, HasSubstr("success-map "));
  EXPECT_THAT(drawn("r", "success-map"), HasSubstr("probability of success"));
  EXPECT_THAT(drawn("r", "success-map", "--lines 'targets[0].mass'"), HasSubstr("probability of success"));
}

TEST_F(Figures, CaptureFitsOnOnePage) {
  ASSERT_EQ(run("run " + scenario("thesis/open-loop-case-1.yaml") +
                " --set approach.duration=2 --set post_impact.duration=1 --no-report --quiet -o r")
                .code,
            0);
  const std::string page = drawn("r", "summary");
  for (const char* panel : {"distance", "energy", "joint angle", "joint rate"}) EXPECT_THAT(page, HasSubstr(panel));
}

// Pairs that never touch have no curve; the latch ends the contacts.
TEST_F(Figures, ContactsAndGripOverTime) {
  ASSERT_EQ(run("run " + scenario("cubesat-two-finger.yaml") + " --no-report --quiet -o r").code, 0);
  const Outcome list = run("figure r --list");
  EXPECT_THAT(list.out, HasSubstr("contacts "));
  EXPECT_THAT(list.out, HasSubstr("grip "));
  const std::string contacts = drawn("r", "contacts"), grip = drawn("r", "grip");
  for (const char* text : {"normal force", "penetration", "left--cubesat"}) EXPECT_THAT(contacts, HasSubstr(text));
  EXPECT_THAT(contacts, Not(HasSubstr("impulse of impacts")));
  for (const char* text : {"grip force", "friction margin", "relative speed", "cubesat"})
    EXPECT_THAT(grip, HasSubstr(text));
  EXPECT_THAT(drawn("r", "summary"), HasSubstr("normal force"));
}

// Two consecutive apostrophes must not end a gnuplot string.
TEST_F(Figures, NamesMayHaveTwoApostrophes) {
  std::string text = read_text(scenario("thesis/open-loop-case-1.yaml"));
  text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
  for (std::size_t at = 0; (at = text.find(": target-1", at)) != std::string::npos; at += 10)
    text.replace(at, 10, ": \"ta''et\"");
  write("named.yaml", text);
  const Outcome o =
      run("run named.yaml --set approach.duration=2 --set post_impact.duration=1 -o \"it''s\" --quiet --no-report");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(run("figure \"it''s\" --what momentum -o \"f/a''b.svg\"").code, 0);
  EXPECT_THAT(read_text(folder_ / "f" / "a''b.svg"), HasSubstr("ta''et"));
}

}  // namespace figures_test
}  // namespace grapnel
