// grapnel optimize as its users meet it: exit codes, files, messages; the scenario it writes runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program_run.hpp"

namespace grapnel {
namespace optimize_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;
using testing::StartsWith;

class Optimize : public test::ProgramRun {
 protected:
  void study(const std::string& simulate, const std::string& more) const {
    std::ofstream(folder_ / "study.yaml")
        << "name: angle\nscenario: " GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1-planned.yaml\n"
        << "simulate: " << simulate << "\n"
        << "set: {approach.plan.starts: 1, post_impact.duration: 1, 'grasps.tip-1.relative_velocity': [0, -0.1, 0]}\n"
        << "minimize: grasps/tip-1/impulse_magnitude\n"
        << "variables: [{quantity: approach_angle, grasp: tip-1, from: -10, to: 30, unit: deg}]\n"
        << more;
  }
};

// Impact only and the whole run, with ideal tracking, meet the same impact.
TEST_F(Optimize, BestScenarioReproducesObjective) {
  for (const std::string simulate : {"impact", "run"}) {
    study(simulate, "search: {evaluations: 12, refine: 1}\n");
    const Outcome o = run("optimize study.yaml -o r -j 2");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_THAT(o.out, HasSubstr("minimize grasps/tip-1/impulse_magnitude"));
    EXPECT_THAT(read_text(folder_ / "r" / "best.yaml"), StartsWith("# Made by grapnel "));
    const auto comparison = nlohmann::json::parse(read_text(folder_ / "r" / "comparison.json"));
    const double after = comparison["objective"]["after"], before = comparison["objective"]["before"];
    EXPECT_LT(after, 0.9 * before);
    ASSERT_EQ(run("run r/best.yaml --quiet -o again").code, 0);
    const auto summary = nlohmann::json::parse(read_text(folder_ / "again" / "summary.json"));
    EXPECT_NEAR(summary["impact"]["grasps"][0]["impulse_magnitude"], after, 1e-9) << simulate;
    EXPECT_EQ(run("check r/best.yaml").code, 0);
  }
}

TEST_F(Optimize, NeverOverwritesUserScenario) {
  study("impact", "search: {evaluations: 4, refine: 0}\n");
  write("best.yaml", "name: mine\n");
  const Outcome o = run("optimize study.yaml -o .");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err, "./best.yaml: error: already exists, and grapnel did not make it; choose another folder with -o\n");
  EXPECT_EQ(read_text(folder_ / "best.yaml"), "name: mine\n");
}

TEST_F(Optimize, TheSameBytesForAnyNumberOfThreads) {
  study("impact", "search: {evaluations: 12, refine: 3}\n");
  for (const char* j : {"1", "3"})
    ASSERT_EQ(run(std::string("optimize study.yaml --quiet -j ") + j + " -o r" + j).code, 0);
  for (const char* file : {"best.yaml", "comparison.json", "evaluations.csv"})
    EXPECT_EQ(read_text(folder_ / "r1" / file), read_text(folder_ / "r3" / file)) << file;
}

TEST_F(Optimize, NoAcceptablePointIsExitCode1WithReason) {
  study("impact",
        "search: {evaluations: 4, refine: 0}\nlimits: [{column: grasps/tip-1/impulse_magnitude, at_most: 0}]\n");
  const Outcome o = run("optimize study.yaml -o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("study.yaml: error: no point meets all limits; the nearest is point "));
  EXPECT_THAT(o.err, HasSubstr("'grasps/tip-1/impulse_magnitude at most 0'"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "best.yaml"));
  EXPECT_TRUE(fs::exists(folder_ / "r" / "evaluations.csv"));
}

TEST_F(Optimize, BadInputFoundBeforeRun) {
  study("impact", "serch: {}\n");
  const Outcome o = run("optimize study.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err,
              HasSubstr("study.yaml:7:1: error: unknown key 'serch' in the optimization; did you mean 'search'?"));
  EXPECT_FALSE(fs::exists(folder_ / "r"));
  EXPECT_EQ(run("optimize nowhere.yaml").code, 2);
  const Outcome schema = run("schema optimization");
  EXPECT_EQ(schema.code, 0);
  EXPECT_TRUE(nlohmann::json::parse(schema.out).contains("properties"));
}

}  // namespace optimize_test
}  // namespace grapnel
