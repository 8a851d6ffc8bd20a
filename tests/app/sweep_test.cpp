// grapnel sweep as its users meet it: exit codes, files, messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "program_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace sweep_test {

namespace fs = std::filesystem;
using test::complaints;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Sweep : public test::ProgramRun {
 protected:
  // Impacts of the open loop, at stated angles of approach.
  fs::path angles(const std::string& values) const {
    return write(
        "study.yaml",
        "name: angles\nscenario: " GRAPNEL_SOURCE_DIR
        "/scenarios/thesis/open-loop-case-1-planned.yaml\n"
        "simulate: impact\nset: {approach.plan.starts: 2}\naxes:\n  - {quantity: approach_angle, unit: deg, values: [" +
            values + "]}\n  - {quantity: relative_speed, values: [0, 0.1]}\n");
  }
};

TEST_F(Sweep, WritesItsTable) {
  angles("0, 10");
  const Outcome o = run("sweep study.yaml -o r -j 2");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(complaints(o), "");
  EXPECT_THAT(o.out, HasSubstr("grapnel 0.2.0, study study.yaml (sha256 "));
  EXPECT_THAT(o.out, HasSubstr("angles: 4 points, 4 ok"));
  EXPECT_THAT(o.out, HasSubstr("grasps/tip-1/impulse_magnitude [N s]"));
  EXPECT_THAT(read_text(folder_ / "r" / "table.csv"),
              StartsWith("point,approach_angle [deg],relative_speed [m/s],status,"));
  EXPECT_GT(fs::file_size(folder_ / "r" / "table.h5"), 10000u);
  const auto settings = nlohmann::json::parse(read_text(folder_ / "r" / "study.json"));
  EXPECT_EQ(settings["schema"], "grapnel-study-table/1");
  EXPECT_EQ(settings["points"], 4);
  EXPECT_EQ(settings["axes"][0]["values"][1], 10.0);
  EXPECT_EQ(settings["text"], read_text(folder_ / "study.yaml"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "table.partial.csv"));
}

// What grapnel check and run say of a scenario, the commands say that run it many times: 8 t with 17 kg m^2.
TEST_F(Sweep, StudiesPrintScenarioWarnings) {
  const std::string head = "name: warnings\nscenario: " + scenario("thesis/open-loop-case-1-planned.yaml") +
                           "\nsimulate: impact\nset: {'targets[0].mass': 8000, approach.plan.starts: 1}\n";
  const std::string says = "targets[0].inertia: the moment of inertia";
  ASSERT_THAT(run("check " + scenario("thesis/open-loop-case-1-planned.yaml") + " --set 'targets[0].mass=8000'").err,
              HasSubstr(says));
  write("sweep.yaml", head + "axes:\n  - {quantity: relative_speed, values: [0.1]}\n");
  write("optimize.yaml", head +
                             "minimize: grasps/tip-1/impulse_magnitude\nsearch: {evaluations: 2, refine: 0}\n"
                             "variables: [{quantity: approach_angle, grasp: tip-1, from: -1, to: 1, unit: deg}]\n");
  write("campaign.yaml", "schema: grapnel-campaign/1\n" + head +
                             "cases: 2\nuncertain:\n  - {path: 'targets[1].mass', as: factor, "
                             "uniform: {from: 0.9, to: 1.1}}\n");
  for (const std::string command : {"sweep", "optimize", "campaign"}) {
    const Outcome o = run(command + " " + command + ".yaml --quiet -o " + command);
    EXPECT_THAT(o.err, HasSubstr(says)) << command << o.out;
    EXPECT_EQ(o.err.find(says), o.err.rfind(says)) << command << ": said more than once";
  }
}

TEST_F(Sweep, TheSameBytesForAnyNumberOfThreads) {
  angles("0, 10, 20");
  for (const char* j : {"1", "2", "4"})
    ASSERT_EQ(run(std::string("sweep study.yaml --quiet -j ") + j + " -o r" + j).code, 0);
  for (const char* file : {"table.csv", "table.h5", "study.json"}) {
    EXPECT_EQ(read_text(folder_ / "r1" / file), read_text(folder_ / "r2" / file)) << file;
    EXPECT_EQ(read_text(folder_ / "r1" / file), read_text(folder_ / "r4" / file)) << file;
  }
}

TEST_F(Sweep, UnreachablePointsGiveExitCode3) {
  SKIP_UNDER_SANITIZERS();
  angles("0, 90");
  const Outcome o = run("sweep study.yaml -o r");
  EXPECT_EQ(o.code, 3);
  EXPECT_THAT(o.err, HasSubstr("study.yaml: warning: 2 of 4 points are not ok"));
  EXPECT_THAT(o.out, HasSubstr("4 points, 2 ok, 2 unreachable"));
  EXPECT_THAT(o.out, HasSubstr("1 × unreachable: planning the approach"));
  EXPECT_THAT(read_text(folder_ / "r" / "table.csv"), HasSubstr("\n2,90,0,unreachable,"));
}

TEST_F(Sweep, BadInputFoundBeforeRun) {
  write("study.yaml", "name: bad\nscenario: nowhere.yaml\naxes:\n  - {quantity: relative_sped, values: [x]}\n");
  const Outcome o = run("sweep study.yaml -o r");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.out, "");
  EXPECT_THAT(o.err, HasSubstr("study.yaml:2:11: error: "));
  EXPECT_THAT(o.err, HasSubstr("study.yaml:4:16: error: unknown value 'relative_sped'"));
  EXPECT_FALSE(fs::exists(folder_ / "r"));
  EXPECT_EQ(run("sweep nowhere.yaml").code, 2);
  EXPECT_EQ(run("sweep study.yaml -j 0").code, 2);
}

TEST_F(Sweep, UnwritableFolderIsNamed) {
  angles("0");
  write("occupied", "a file where the folder should be");
  const Outcome o = run("sweep study.yaml -o occupied");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("cannot write results to 'occupied'"));
}

TEST_F(Sweep, QuietPrintsNothingAndFolderHasStudyName) {
  angles("0");
  const Outcome o = run("sweep study.yaml --quiet");
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(o.out + o.err, "");
  EXPECT_TRUE(fs::exists(folder_ / "out" / "study" / "table.csv"));
}

// The earlier table stays until the new one is complete; rows so far are beside it.
TEST_F(Sweep, KilledSweepLeavesReadableTables) {
  angles("0");
  ASSERT_EQ(run("sweep study.yaml --quiet -o r").code, 0);
  const std::string before = read_text(folder_ / "r" / "table.csv");
  write("long.yaml", "name: long\nscenario: " GRAPNEL_SOURCE_DIR
                     "/scenarios/thesis/closed-loop.yaml\n"
                     "simulate: impact\naxes:\n  - {quantity: relative_speed, from: 0, to: 1, count: 100000}\n");
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const fs::path study = folder_ / "long.yaml", result = folder_ / "r";
    execl(GRAPNEL_PROGRAM, "grapnel", "sweep", study.c_str(), "--quiet", "-o", result.c_str(), nullptr);
    _exit(127);
  }
  const fs::path partial = folder_ / "r" / "table.partial.csv";
  for (int tries = 0; tries < 3000 && (!fs::exists(partial) || fs::file_size(partial) < 20000); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(read_text(folder_ / "r" / "table.csv"), before);
  EXPECT_THAT(read_text(partial), HasSubstr("\n0,0,ok,,"));
}

TEST_F(Sweep, SchemaIsJson) {
  const Outcome o = run("schema study");
  EXPECT_EQ(o.code, 0);
  EXPECT_TRUE(nlohmann::json::parse(o.out).contains("properties"));
}

}  // namespace sweep_test
}  // namespace grapnel
