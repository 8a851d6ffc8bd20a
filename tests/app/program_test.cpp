// The command-line program: commands, exit codes, files, messages. Other tests cover the physics.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "program_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace program_test {

namespace fs = std::filesystem;
using test::complaints;
using test::Outcome;
using test::read_text;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class Program : public test::ProgramRun {};

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

const std::string kCase1 = "thesis/open-loop-case-1.yaml";
// Short phases suffice for these tests.
const std::string kShort = " --set approach.duration=2 --set post_impact.duration=1 ";

TEST_F(Program, MarginsOnRequest) {
  const std::string arguments = "run " + scenario("air-bearing-friction.yaml") + " --no-report ";
  const Outcome without = run(arguments + "-o without"), with = run(arguments + "-o with --margins");
  ASSERT_EQ(without.code, 0) << without.err;
  ASSERT_EQ(with.code, 0) << with.err;
  EXPECT_THAT(with.out, HasSubstr("linear model of post_impact at t = 0 s: not decided"));
  auto summary = nlohmann::json::parse(read_text(folder_ / "with" / "summary.json"));
  EXPECT_EQ(summary["control_loops"].size(), 2u);
  EXPECT_EQ(summary["control_loops"][0]["laws"][0], "pd of 5 joints");
  // Everything else is the same, except for the times of computation.
  summary.erase("control_loops");
  auto plain = nlohmann::json::parse(read_text(folder_ / "without" / "summary.json"));
  for (auto* one : {&summary, &plain}) one->erase("cost");
  EXPECT_EQ(summary, plain);
}

TEST_F(Program, RunWritesDocumentedFiles) {
  const Outcome o = run("run " + scenario(kCase1) + kShort + "-o result");
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.err,
              testing::MatchesRegex(".*open-loop-case-1.yaml: warning: captured: assumed, by moving target-1 .* and "
                                    "target-2 .*: no capture envelope is given for tip-1 and tip-2\n"));
  EXPECT_THAT(o.out, HasSubstr("grapnel 0.2.0"));
  EXPECT_THAT(o.out, HasSubstr("sha256"));
  EXPECT_THAT(o.out, HasSubstr("ledger"));
  EXPECT_TRUE(fs::exists(folder_ / "result" / "timeseries.h5"));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "result" / "summary.json"));
  EXPECT_EQ(summary["scenario"]["name"], "open-loop case 1");
  EXPECT_EQ(summary["scenario"]["sha256"].get<std::string>().size(), 64u);
  EXPECT_EQ(summary["approach"]["end"]["time"], 2.0);
  EXPECT_EQ(summary["approach"]["end"]["end_effectors"][0]["target"], "target-1");
  EXPECT_EQ(summary["impact"]["rank"], 12);
  EXPECT_GT(summary["impact"]["grasps"][0]["impulse_magnitude"].get<double>(), 0.01);
  EXPECT_EQ(summary["post_impact"]["end"]["time"], 3.0);
  for (const char* key : {"linear_momentum_drift", "angular_momentum_drift", "generalized_momentum_residual",
                          "energy_identity_residual", "work_energy_residual", "energy_drift", "loop_closure_position",
                          "loop_closure_angle", "unprojected_defect", "correction_total"}) {
    ASSERT_TRUE(summary["ledger"].contains(key)) << key;
    EXPECT_LE(summary["ledger"][key]["value"].get<double>(), summary["ledger"][key]["bound"].get<double>()) << key;
    EXPECT_TRUE(summary["ledger"][key]["pass"].get<bool>()) << key;
  }
  EXPECT_GT(summary["ledger"]["scale"]["angular_momentum"].get<double>(), 1.0);
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

// Compares words exactly and numbers to 0.1 %; values below 1e-10 are rounding errors and equal.
bool same_words(const std::string& shown, const std::string& printed) {
  const std::vector<std::string> a = words_of(shown), b = words_of(printed);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const std::string& x, const std::string& y) {
    if (x == y) return true;
    char *x_end = nullptr, *y_end = nullptr;
    const double u = std::strtod(x.c_str(), &x_end), v = std::strtod(y.c_str(), &y_end);
    if (x_end == x.c_str() || y_end == y.c_str() || std::string(x_end) != y_end) return false;
    return std::abs(u - v) <= 1e-3 * std::abs(u) || (std::abs(u) < 1e-10 && std::abs(v) < 1e-10);
  });
}

// Every ```console block of README.md and docs/thesis.md is a command, `$ build/release/bin/grapnel run ...`, and lines
// of its output; a line "..." stands for omitted lines.
TEST_F(Program, OutputMatchesReadme) {
  SKIP_UNDER_SANITIZERS();
  std::istringstream readme(read_text(GRAPNEL_SOURCE_DIR "/README.md") + "\n" +
                            read_text(GRAPNEL_SOURCE_DIR "/docs/thesis.md"));
  const std::string prompt = "$ build/release/bin/grapnel run scenarios/";
  int shown = 0;
  for (std::string line; std::getline(readme, line);) {
    if (line != "```console") continue;
    ASSERT_TRUE(std::getline(readme, line));
    ASSERT_EQ(line.substr(0, prompt.size()), prompt);
    const Outcome o = run("run " + scenario(line.substr(prompt.size())) + " --no-report --force -o r");
    EXPECT_EQ(o.code, 0) << line << o.err;
    std::vector<std::string> printed;
    std::istringstream out(o.out);
    for (std::string one; std::getline(out, one);) printed.push_back(one);
    while (std::getline(readme, line) && line != "```") {
      if (line == "...") continue;
      EXPECT_TRUE(std::any_of(printed.begin(), printed.end(), [&](const auto& p) { return same_words(line, p); }))
          << line;
      ++shown;
    }
  }
  EXPECT_GE(shown, 3);
}

TEST_F(Program, SameInputProducesSameBytes) {
  for (const char* name : {"a", "b"}) ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--quiet -o " + name).code, 0);
  EXPECT_EQ(read_text(folder_ / "a" / "summary.json"), read_text(folder_ / "b" / "summary.json"));
  EXPECT_EQ(read_text(folder_ / "a" / "timeseries.h5"), read_text(folder_ / "b" / "timeseries.h5"));
}

TEST_F(Program, QuietPrintsNothing) {
  const Outcome o = run("run " + scenario(kCase1) + kShort + "--quiet -o r");
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(o.out, "");
  EXPECT_THAT(o.err, testing::MatchesRegex("[^\n]*: warning: captured: assumed[^\n]*\n"));  // --quiet keeps warnings
}

TEST_F(Program, OutputDefaultsToScenarioName) {
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--quiet").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "open-loop-case-1" / "summary.json"));
}

TEST_F(Program, AbsentPhasesAreAbsentFromTheSummary) {
  std::string text = read_text(scenario(kCase1));
  const auto cut = [&](const std::string& from, const std::string& to) {
    const std::size_t a = text.find(from), b = text.find(to);
    text.erase(a, b - a);
  };
  cut("\nimpact:", "\noutput:");
  text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
  const fs::path file = write("approach-only.yaml", text);
  const Outcome o = run("run " + file.string() + " --set approach.duration=2 -o r");
  ASSERT_EQ(o.code, 0) << o.err;
  const auto summary = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  EXPECT_TRUE(summary.contains("approach"));
  EXPECT_FALSE(summary.contains("impact"));
  EXPECT_FALSE(summary.contains("post_impact"));
}

TEST_F(Program, CheckReportsAllErrorsWithPositions) {
  std::string text = read_text(scenario(kCase1));
  text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
  text.replace(text.find("model: rigid"), 12, "model: rigd");
  text.replace(text.find("  duration: 20"), 14, "  durtion: 20");
  const fs::path file = write("bad.yaml", text);
  const Outcome o = run("check " + file.string());
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.out, "");
  EXPECT_THAT(o.err, HasSubstr("bad.yaml:"));
  EXPECT_THAT(o.err, HasSubstr("unknown value 'rigd' for grasps[0].model; did you mean 'rigid'?"));
  EXPECT_THAT(o.err, HasSubstr("unknown key 'durtion' in approach; did you mean 'duration'?"));
  EXPECT_EQ(run("run " + file.string() + " -o r").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "r"));
}

TEST_F(Program, CheckAcceptsValidScenarios) {
  const Outcome o = run("check " + scenario(kCase1));
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("no errors"));
}

TEST_F(Program, MissingFileIsBadInput) {
  const Outcome o = run("run nowhere.yaml");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("nowhere.yaml"));
}

TEST_F(Program, WrongUsageIsBadInput) {
  EXPECT_EQ(run("").code, 2);
  EXPECT_EQ(run("fly").code, 2);
  EXPECT_EQ(run("run " + scenario(kCase1) + " --set nonsense").code, 2);
  EXPECT_EQ(run("export .").code, 2);
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_EQ(run("--version").code, 0);
}

TEST_F(Program, ConservationFailureIsNoResult) {
  const std::string planned =
      scenario("thesis/open-loop-case-1-planned.yaml") + " --set 'contact={gap: weld_as_found}'";
  const Outcome coarse =
      run("run " + planned + " --set integration.method=rk4 --set integration.step=2 -o r --no-report");
  EXPECT_EQ(coarse.code, 1);
  EXPECT_THAT(coarse.err, HasSubstr("error: conservation check failed: energy_drift is "));
  EXPECT_THAT(coarse.err, HasSubstr("smaller integration.step"));
  EXPECT_THAT(coarse.err, testing::Not(HasSubstr("tolerance")));
  const auto stored = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  EXPECT_EQ(stored["status"], "completed");
  EXPECT_EQ(stored["ledger"]["pass"], false);
  EXPECT_THAT(stored["ledger"]["energy_drift"]["advice"].get<std::string>(), HasSubstr("integration.step"));
  EXPECT_THAT(stored["ledger"]["energy_drift"]["note"].get<std::string>(), HasSubstr("servicer + "));
  EXPECT_FALSE(stored["ledger"]["linear_momentum_drift"].contains("advice"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "r" / "timeseries.h5"));

  // A result for comparison only is not a success.
  const Outcome published = run("run " + planned + " --set impact.law=as_published -o p --no-report");
  EXPECT_EQ(published.code, 1);
  EXPECT_THAT(published.err, HasSubstr("linear_momentum_drift is "));
  EXPECT_THAT(published.err, HasSubstr("impact.law: as_published is for comparison only"));
  EXPECT_EQ(run("run " + planned + " -o good --no-report").code, 0);
}

// The published case: a target moved to a tip without an evaluated envelope, and shapes that overlap later.
TEST_F(Program, ReportsAssumptionsAndValidity) {
  const Outcome o = run("run " + scenario(kCase1) + " -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(
      o.out,
      HasSubstr("\ncaptured: assumed, by moving target-1 106 mm and target-2 64.8 mm (2 of 2 grasps, t = 20 s,"));
  EXPECT_THAT(o.out, testing::ContainsRegex("\nfeasible: NO, valid until 3[0-9.]+ s: .* overlap from then on"));
  EXPECT_THAT(o.out, HasSubstr("worst in post_impact: base and target-1 overlap by 0.68"));
  EXPECT_THAT(o.out, testing::Not(HasSubstr("n/a")));
  EXPECT_THAT(o.err, HasSubstr("warning: captured: assumed, by moving target-1 106 mm"));
  EXPECT_THAT(o.err, HasSubstr("warning: feasible: NO, valid until 3"));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  EXPECT_EQ(summary["schema"], "grapnel-summary/2");
  EXPECT_EQ(summary["capture"]["captured"], "assumed");
  EXPECT_NEAR(summary["capture"]["grasps"][0]["target_moved"].get<double>(), 0.1056, 1e-3);
  EXPECT_EQ(summary["ledger"]["feasible"], "no");
  EXPECT_EQ(summary["feasibility"]["first"]["kind"], "overlap");
  EXPECT_EQ(summary["feasibility"]["first"]["time"], summary["feasibility"]["valid_until"]);
  EXPECT_EQ(summary["feasibility"]["worst"]["kind"], "overlap");

  // Without checks the result states "not checked"; from a large distance there is no capture.
  const Outcome unseen = run("run " + scenario(kCase1) + kShort + "--set clearance.enabled=false -o r");
  EXPECT_THAT(unseen.out, HasSubstr("\nfeasible: not checked; clearance: switched off by clearance.enabled\n"));
  const Outcome far = run("run " + scenario(kCase1) + kShort +
                          "--set contact.gap=weld_as_found --set 'targets.target-1.state.position=[40,-2,0]' -o r");
  EXPECT_EQ(far.code, 1);
  EXPECT_THAT(far.err,
              HasSubstr("m from grasp point 'grip' of target 'target-1', more than a tenth of its arm's reach"));
  EXPECT_THAT(far.out, HasSubstr("\ncaptured: NO (0 of 2 grasps"));
}

// The first example: the end-effectors reach their envelopes, and all clearances and joint limits are satisfied.
TEST_F(Program, FirstExampleIsFeasible) {
  const Outcome o = run("run " + scenario("dual-arm-satellite-handles.yaml") + " -o r");
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(complaints(o), "");
  EXPECT_THAT(o.out, HasSubstr("\ncaptured: yes (2 of 2 grasps, t = 45 s, largest gap 6.56 mm)"));
  EXPECT_THAT(o.out, HasSubstr("\nfeasible: yes, clearance and joint limits are kept\n"));
}

TEST_F(Program, FailedSimulationPreservesResults) {
  const Outcome o =
      run("run " + scenario(kCase1) + " --set integration.max_steps=300 --set approach.tracking.kp=490 -o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("the simulation failed"));
  EXPECT_THAT(o.err, HasSubstr("t = "));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  EXPECT_EQ(summary["status"], "failed");
  EXPECT_FALSE(summary["failure"].get<std::string>().empty());
}

TEST_F(Program, RefusedContactNamesArmAndGap) {
  const Outcome o = run("run " + scenario(kCase1) + " --set 'contact={gap: refuse, limit: 0.05}' -o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("contact refused: end-effector 'tip-1' misses grasp point 'grip' of target 'target-1'"));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  EXPECT_TRUE(summary.contains("approach"));
  EXPECT_FALSE(summary.contains("impact"));
}

TEST_F(Program, UnwritableFolderIsNamed) {
  const fs::path file = write("occupied", "a file where the folder should be");
  const Outcome o = run("run " + scenario(kCase1) + kShort + "-o occupied");
  EXPECT_EQ(o.code, 2);
  EXPECT_THAT(o.err, HasSubstr("cannot write results to 'occupied'"));
  EXPECT_EQ(read_text(file), "a file where the folder should be");
}

TEST_F(Program, FullStandardOutputIsError) {
  const std::string err = (folder_ / "stderr").string();
  const int status = std::system(
      ("'" GRAPNEL_PROGRAM "' check '" + scenario(kCase1) + "' > /dev/full 2>'" + err + "' </dev/null").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_THAT(read_text(err), HasSubstr("cannot write to standard output"));
}

TEST_F(Program, InfeasiblePlanReportsCause) {
  SKIP_UNDER_SANITIZERS();
  const std::string first = scenario("first-plan.yaml");
  ASSERT_EQ(run("run " + first + " --quiet -o p --set post_impact.duration=0.1").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "p" / "timeseries.h5"));
  const auto summary = nlohmann::json::parse(read_text(folder_ / "p" / "summary.json"));
  EXPECT_EQ(summary["capture"]["captured"], "assumed");                              // the robot has no grippers
  EXPECT_LT(summary["approach"]["end"]["end_effectors"][0]["miss_distance"], 1e-9);  // measured 7e-13

  const Outcome o = run("run " + first + " -o p --set 'targets.debris.state.position=[5,-2,0]'");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("end-effector 'tip-1' comes no closer than 1.787 m: the grasp point is 4.787 m from "
                               "joint 'arm-1-joint-1' and the arm is at most 3 m long"));
  const auto failed = nlohmann::json::parse(read_text(folder_ / "p" / "summary.json"));
  EXPECT_EQ(failed["status"], "failed");
  EXPECT_NEAR(failed["approach"]["plan"]["miss"][0]["distance"], 1.787, 1e-3);
  EXPECT_FALSE(fs::exists(folder_ / "p" / "timeseries.h5"));  // the earlier series does not belong to this summary
}

TEST_F(Program, ExportWritesCsvAndMat) {
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--quiet -o r").code, 0);
  const Outcome o = run("export r --csv --mat");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(read_text(folder_ / "r" / "timeseries.csv"), HasSubstr("base/position/x [m]"));
  EXPECT_GT(fs::file_size(folder_ / "r" / "timeseries.mat"), 1000u);
  const Outcome none = run("export empty --csv");
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("timeseries.h5"));
}

TEST_F(Program, SchemaIsJson) {
  for (const char* which : {"", "scenario", "robot"}) {
    const Outcome o = run(std::string("schema ") + which);
    EXPECT_EQ(o.code, 0);
    EXPECT_TRUE(nlohmann::json::parse(o.out).contains("properties"));
  }
  EXPECT_EQ(run("schema wrong").code, 2);
}

TEST_F(Program, InfoDescribesRobot) {
  const Outcome o = run("info " GRAPNEL_SOURCE_DIR "/robots/planar-dual-arm.yaml");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("mass 560 kg"));
  EXPECT_THAT(o.out, HasSubstr("tip-1"));
  EXPECT_THAT(o.out, Not(HasSubstr("reaction wheel")));
  EXPECT_EQ(run("info nowhere.yaml").code, 2);
}

TEST_F(Program, InfoListsActuators) {
  const Outcome o = run("info " GRAPNEL_SOURCE_DIR "/robots/servicing-dual-arm-thrusters.yaml");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, ContainsRegex("wheel-1 +0.159 +1 +628.319 +99.9026 +.0.8, 0, 0.6"));
  EXPECT_THAT(o.out, ContainsRegex("x.-1 +22 +220 +0.02 +.0, 0.9, 0. +.0, 0, 1"));
  EXPECT_THAT(o.out, HasSubstr("propellant for the thrusters: 60 kg"));
}

// --- Implausible input
// ------------------------------------------------------------------------------------------------

std::string first_plan(const std::string& changes) {
  return "run " GRAPNEL_SOURCE_DIR "/scenarios/first-plan.yaml --no-report -o r" + changes;
}

TEST_F(Program, CheckWarnsOfImplausibleInput) {
  const Outcome o = run("check " + scenario(kCase1) + " --set targets.target-1.inertia=[900,900,900]");
  EXPECT_EQ(o.code, 0);
  EXPECT_THAT(o.out, HasSubstr("no errors, 1 warning ("));
  EXPECT_THAT(o.err,
              HasSubstr("--set targets.target-1.inertia=[900,900,900]: warning: targets[0].inertia: the moment of "
                        "inertia 900 kg m^2 and the mass 10 kg make a radius of gyration of 9.49 m"));
  EXPECT_EQ(run("check " + scenario(kCase1)).err, "");
}

TEST_F(Program, WarningsAreStoredAndPrintedOnce) {
  const Outcome o = run("run " + scenario(kCase1) + kShort + "--set targets.target-1.inertia=[900,900,900] -o r");
  EXPECT_EQ(o.code, 0) << o.err;
  const auto summary = nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"));
  ASSERT_FALSE(summary["warnings"].empty());
  EXPECT_THAT(summary["warnings"][0].get<std::string>(),
              testing::StartsWith("targets[0].inertia: the moment of inertia"));
  EXPECT_EQ(occurrences(o.out + o.err, "radius of gyration"), 1u);
}

TEST_F(Program, FailedPlanReportedOnceWithRemedy) {
  SKIP_UNDER_SANITIZERS();
  const Outcome o = run(first_plan(" --set targets[0].state.position=[9,0,0]"));
  EXPECT_EQ(o.code, 1);
  EXPECT_EQ(occurrences(o.out + o.err, "comes no closer"), 1u) << o.out << o.err;
  EXPECT_THAT(o.err, HasSubstr("the arm is at most 3 m long; base and target must be 5."));
  EXPECT_THAT(o.err, testing::Not(HasSubstr("Check first")));
  EXPECT_THAT(read_text(folder_ / "r" / "summary.json"), HasSubstr("comes no closer"));
}

TEST_F(Program, FailedPlanListsWarnings) {
  SKIP_UNDER_SANITIZERS();
  const Outcome o = run(first_plan(" --set targets[0].grasp_points[0].position=[0,9,0]"));
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr(". Check first: targets[0].grasp_points[0].position is 9 m from the target's "
                               "origin, and its shape ends at 0.5 m"));
}

// --- Messages and streams
// ---------------------------------------------------------------------------------------------

TEST_F(Program, OutputsInOnePipePreserveLines) {
  const std::string both = (folder_ / "both").string();
  const std::string command = "cd '" + folder_.string() + "' && '" GRAPNEL_PROGRAM "' run '" + scenario(kCase1) + "'" +
                              kShort + "--set impact.law=as_published -o r >'" + both + "' 2>&1 </dev/null";
  ASSERT_NE(std::system(command.c_str()), -1);
  const std::string text = read_text(both);
  const std::size_t results = text.find("\nresults in r: "), warning = text.find(".yaml: warning: ");
  ASSERT_NE(results, std::string::npos) << text;
  ASSERT_NE(warning, std::string::npos) << text;
  EXPECT_LT(results, warning) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.find(scenario(kCase1) + ": warning: ");
    EXPECT_TRUE(at == std::string::npos || at == 0) << line;
  }
}

TEST_F(Program, ControlCharactersAreEscaped) {
  for (const char* arguments : {"report", "export --csv", "figure --list", "merge -o m", "run", "info"}) {
    const Outcome o = run(std::string(arguments) + " \"$(printf 'x\\033[31m\\302\\233m\\007\\342\\200\\256')\"");
    if (o.err.find("was built without Node.js") != std::string::npos) continue;  // reports are not available
    EXPECT_EQ(o.code, 2) << arguments;
    EXPECT_THAT(o.out + o.err, HasSubstr("x?[31m?m??")) << arguments;
    EXPECT_THAT(o.out + o.err, testing::Not(HasSubstr("\x1b"))) << arguments;
    EXPECT_THAT(o.out + o.err, testing::Not(HasSubstr("\xc2\x9b"))) << arguments;
  }
}

TEST_F(Program, SeriesWriteErrorPreservesOtherFiles) {
  // A nonempty folder occupies the path of the file.
  fs::create_directories(folder_ / "r" / "timeseries.h5" / "x");
  const Outcome o = run("run " + scenario(kCase1) + kShort + "-o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("timeseries.h5"));
  EXPECT_THAT(o.out, HasSubstr("ledger"));
  EXPECT_THAT(o.out, HasSubstr("results in r: summary.json, scene.json\n"));
  EXPECT_EQ(nlohmann::json::parse(read_text(folder_ / "r" / "summary.json"))["status"], "completed");
  EXPECT_TRUE(fs::exists(folder_ / "r" / "scene.json"));
  EXPECT_FALSE(fs::exists(folder_ / "r" / "report.html"));
}

TEST_F(Program, HelpNamesDefaults) {
  EXPECT_THAT(run("run --help").out, HasSubstr("out/ and the scenario file's name without .yaml"));
  EXPECT_THAT(run("report --help").out, HasSubstr("report-vs-SECOND.html"));
  EXPECT_THAT(run("schema --help").out, HasSubstr("(default: scenario)"));
  const Outcome o = run("run " + scenario(kCase1) + kShort + "--no-report");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_TRUE(fs::exists(folder_ / "out" / "open-loop-case-1" / "summary.json"));
}

// A run killed at any time leaves either the previous results or the new ones, both complete.
TEST_F(Program, KilledRunLeavesReadableFiles) {
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--quiet -o r").code, 0);
  for (int milliseconds = 1; milliseconds < 120; milliseconds += 17) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const fs::path result = folder_ / "r";
      execl(GRAPNEL_PROGRAM, "grapnel", "run", scenario(kCase1).c_str(), "--quiet", "-o", result.c_str(), nullptr);
      _exit(127);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(nlohmann::json::accept(read_text(folder_ / "r" / "summary.json"))) << milliseconds;
    EXPECT_EQ(run("export r --csv").code, 0) << milliseconds;
  }
}

}  // namespace program_test
}  // namespace grapnel
