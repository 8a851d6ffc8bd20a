// The program in adverse environments: unwritable outputs, very long computations, planted files.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "program_run.hpp"

namespace grapnel {
namespace surroundings_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kCase1 = "thesis/open-loop-case-1.yaml";
const std::string kShort = " --set approach.duration=2 --set post_impact.duration=1 ";
// A capture window search of long duration.
const std::string kEndless = " --set approach.window.step=0.02 ";  // 6000 plans

class Surroundings : public test::ProgramRun {
 protected:
  // Runs a shell command in the test folder, with the program as $G; returns its exit code or the negative signal
  // number.
  int shell(const std::string& line) const {
    const std::string command = "cd '" + folder_.string() + "' && G='" GRAPNEL_PROGRAM "' && " + line;
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  // Starts `grapnel ARGUMENTS`; its output goes to the file "said".
  pid_t start(const std::string& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    const std::string line = "cd '" + folder_.string() + "' && exec '" GRAPNEL_PROGRAM "' " + arguments + " >said 2>&1";
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
  // Returns the exit code after SIGTERM; -1 if the signal terminated the process or it was killed after one minute.
  static int stop(pid_t child) {
    kill(child, SIGTERM);
    int status = 0;
    for (int i = 0; i < 600; ++i) {
      if (waitpid(child, &status, WNOHANG) == child) return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return -1;
  }
  void await(const fs::path& file) const {
    for (int i = 0; i < 600 && !fs::exists(folder_ / file); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ASSERT_TRUE(fs::exists(folder_ / file)) << file;
  }
  nlohmann::json summary(const std::string& folder) const {
    return nlohmann::json::parse(read_text(folder_ / folder / "summary.json"));
  }
};

// --- Nowhere to write -----------------------------------------------------------------------------------------------

TEST_F(Surroundings, ClosedStderrPreservesExitCode) {
  for (const std::string nowhere : {" 2>/dev/full", " 2>&-", " >&- 2>&-"}) {
    EXPECT_EQ(shell("$G check nowhere.yaml" + nowhere), 2) << nowhere;
    EXPECT_EQ(shell("$G run nowhere.yaml" + nowhere), 2) << nowhere;
    EXPECT_EQ(
        shell("$G run '" + scenario(kCase1) + "'" + kShort + "--set integration.max_steps=3 --quiet -o r" + nowhere), 1)
        << nowhere;
    EXPECT_EQ(shell("$G run '" + scenario(kCase1) + "'" + kShort + "--quiet -o r" + nowhere), 0) << nowhere;
    EXPECT_EQ(summary("r")["scenario"]["name"], "open-loop case 1") << nowhere;
  }
}

TEST_F(Surroundings, FileSizeLimitIsErrorAndSummaryIsPreserved) {
  // 512-byte blocks: enough for the summary, not for the series.
  EXPECT_EQ(shell("ulimit -f 400; $G run '" + scenario(kCase1) + "'" + kShort +
                  "--set output.interval=0.001 --no-report -o r >out 2>err"),
            1);
  EXPECT_THAT(read_text(folder_ / "err"), AllOf(HasSubstr("timeseries.h5"), HasSubstr("File too large")));
  EXPECT_THAT(read_text(folder_ / "out"), HasSubstr("ledger"));
  EXPECT_EQ(summary("r")["status"], "completed");
  EXPECT_FALSE(fs::exists(folder_ / "r" / "timeseries.h5"));
}

TEST_F(Surroundings, FullDiskInExportIsNotBadInput) {
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--no-report --quiet -o r").code, 0);
  for (const std::string format : {"--csv", "--mat", "--mcap", "--glb"}) {
    EXPECT_EQ(shell("ulimit -f 8; $G export r " + format + " 2>err"), 1) << format;
    EXPECT_THAT(read_text(folder_ / "err"), HasSubstr("cannot write r/")) << format;
  }
  EXPECT_EQ(shell("$G export nothing --csv 2>err"), 2);
}

// --- Work without end -----------------------------------------------------------------------------------------------

TEST_F(Surroundings, PlanningLimitReportsRemedy) {
  const std::string first = scenario("first-plan.yaml");
  const Outcome o = run("run " + first + " --set approach.plan.max_evaluations=1000 --no-report -o r");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, AllOf(HasSubstr("evaluation limit reached after 1000 evaluations"),
                           HasSubstr("approach.plan.max_evaluations")));
  EXPECT_EQ(summary("r")["status"], "failed");
  const Outcome steps = run("run " + first + " --set integration.max_steps=5 --no-report -o r");
  EXPECT_EQ(steps.code, 1);
  EXPECT_THAT(steps.err, HasSubstr("steps"));
}

TEST_F(Surroundings, SignalStopsPlanningAndPreservesResults) {
  const pid_t child = start("run " + scenario("tumbling-window.yaml") + kEndless + "-o r");
  await("r");
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_EQ(stop(child), 130);
  EXPECT_THAT(read_text(folder_ / "said"), HasSubstr("stopped; the results so far are in r"));
  EXPECT_EQ(summary("r")["status"], "failed");
}

TEST_F(Surroundings, SignalsAndTimeLimitStopPlanningCampaign) {
  write("campaign.yaml",
        "schema: grapnel-campaign/1\nname: endless\nscenario: endless.yaml\nplan: per_case\ncases: 2\n"
        "uncertain:\n  - {path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}\n"
        "keep: {columns: [captured]}\n");
  std::string text = read_text(scenario("first-plan.yaml"));
  text.replace(text.find("../robots"), 9, GRAPNEL_SOURCE_DIR "/robots");
  text.replace(text.find("duration: 20"), 12, "duration: 200000");
  text.replace(text.find("plan: {}"), 8, "plan: {max_evaluations: 1000000000000, starts: 1000}");
  write("endless.yaml", text);
  const pid_t child = start("campaign campaign.yaml -j 1 -o c");
  await("c/shards");
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));
  EXPECT_EQ(stop(child), 130);
  EXPECT_THAT(read_text(folder_ / "said"), HasSubstr("stopped: 0 of 2 cases are kept in c"));
  std::ofstream(folder_ / "campaign.yaml", std::ios::app) << "time_limit: 0.5\n";
  const Outcome limited = run("campaign campaign.yaml -j 1 -o limited");
  EXPECT_EQ(limited.code, 3) << limited.err;
  EXPECT_THAT(read_text(folder_ / "limited" / "table.csv"), HasSubstr("took longer than the time limit of 0.5 s"));
}

// --- Many samples ---------------------------------------------------------------------------------------------------

TEST_F(Surroundings, LongSeriesAreStreamed) {
  // More than one block of 64 MB.
  const std::string arguments =
      "run " + scenario(kCase1) + kShort + "--set output.interval=0.00004 --no-report --quiet ";
  const Outcome o = run(arguments + "-o r");
  ASSERT_EQ(o.code, 0) << o.err;
  const Outcome csv = run("export r --csv");
  ASSERT_EQ(csv.code, 0) << csv.err;
  std::ifstream lines(folder_ / "r" / "timeseries.csv");
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line);) ++count;
  EXPECT_EQ(count, 1 + 50'001 + 2 + 25'001);  // header, approach, impact, post-impact
}

TEST_F(Surroundings, AnnouncesSizeOfSeries) {
  const std::string arguments = "run " + scenario(kCase1) + kShort + "--set integration.max_steps=1 --no-report -o r ";
  EXPECT_THAT(run(arguments + "--set output.interval=0.000001").err,
              AllOf(HasSubstr("makes about 3e+06 samples"), HasSubstr("GB in timeseries.h5 before compression")));
  EXPECT_THAT(run(arguments + "--set output.interval=0.001").err, Not(HasSubstr("GB")));
}

// --- Planted and left files -----------------------------------------------------------------------------------------

TEST_F(Surroundings, LinksAreNotFollowed) {
  write("precious", "x");
  fs::create_directories(folder_ / "elsewhere");
  write("campaign.yaml", "schema: grapnel-campaign/1\nname: two\nscenario: " + scenario(kCase1) +
                             "\nsimulate: impact\ncases: 2\nuncertain:\n  - {path: \"targets[0].mass\", as: factor, "
                             "uniform: {from: 0.9, to: 1.1}}\nkeep: {columns: [captured]}\n");
  fs::create_directories(folder_ / "c");
  fs::create_symlink(folder_ / "precious", folder_ / "c" / "lock");
  Outcome o = run("campaign campaign.yaml -o c");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("c/lock: it is a symbolic link"));
  fs::remove(folder_ / "c" / "lock");
  fs::create_symlink(folder_ / "elsewhere", folder_ / "c" / "shards");
  o = run("campaign campaign.yaml -o c");
  EXPECT_EQ(o.code, 1);
  EXPECT_THAT(o.err, HasSubstr("c/shards: it is a symbolic link"));
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
  fs::create_directories(folder_ / "s");
  fs::create_symlink(folder_ / "precious", folder_ / "s" / "table.partial.csv");
  write("study.yaml", "schema: grapnel-study/1\nname: one\nscenario: " + scenario(kCase1) +
                          "\nsimulate: impact\naxes:\n  - {path: \"targets[0].mass\", values: [10]}\n");
  o = run("sweep study.yaml -o s");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(read_text(folder_ / "precious"), "x");
}

TEST_F(Surroundings, RemovesFilesOfKilledRun) {
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--no-report --quiet -o r").code, 0);
  const fs::path left = folder_ / "r" / ".timeseries.h5.tmp-1073741824-0", notes = folder_ / "r" / ".my.tmp-notes";
  for (const fs::path& file : {left, notes}) {
    std::ofstream(file) << "x";
    fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(48));
  }
  ASSERT_EQ(run("run " + scenario(kCase1) + kShort + "--no-report --quiet -o r").code, 0);
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(notes));  // not created by grapnel
}

// --- The same everywhere --------------------------------------------------------------------------------------------

TEST_F(Surroundings, OutputIndependentOfFolder) {
  for (const char* place : {"here", "there/under"}) {
    fs::create_directories(folder_ / place);
    std::string text = read_text(scenario(kCase1));
    text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
    std::ofstream(folder_ / place / "one.yaml") << text;
    std::ofstream(folder_ / place / "study.yaml")
        << "schema: grapnel-study/1\nname: two\nscenario: one.yaml\nsimulate: impact\naxes:\n"
           "  - {path: \"targets[0].mass\", values: [9, 10]}\n";
    std::ofstream(folder_ / place / "campaign.yaml")
        << "schema: grapnel-campaign/1\nname: two\nscenario: one.yaml\nsimulate: impact\ncases: 2\nuncertain:\n"
           "  - {path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}\nkeep: {columns: [captured]}\n";
    const std::string at = place;
    ASSERT_EQ(run("run " + at + "/one.yaml" + kShort + "-o " + at + "/r").code, 0);
    ASSERT_EQ(run("sweep " + at + "/study.yaml -o " + at + "/s").code, 0);
    ASSERT_EQ(run("campaign " + at + "/campaign.yaml -o " + at + "/c").code, 0);
  }
  std::size_t compared = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "here")) {
    const fs::path file = fs::relative(entry.path(), folder_ / "here");
    if (!entry.is_regular_file() || file.filename() == "manifest.json") continue;  // contains the path of the campaign
    EXPECT_TRUE(read_text(entry.path()) == read_text(folder_ / "there/under" / file)) << file;
    ++compared;
  }
  EXPECT_GE(compared, 12u);
  EXPECT_EQ(read_text(folder_ / "here/c/report.html").find("No single cases"), std::string::npos);
}

// Excessive impedance stiffness forces steps of 1e-6 s; warnings report the progress and the reason.
TEST_F(Surroundings, SlowRunReportsReasonWithQuiet) {
  const pid_t child = start("run " + scenario("impedance-capture.yaml") +
                            " --set impedance.stiffness=1e12 --set impedance.damping=1e9 --quiet --no-report -o r");
  for (int i = 0; i < 600 && read_text(folder_ / "said").find("slow: ") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(stop(child), 130);
  EXPECT_THAT(read_text(folder_ / "said"), HasSubstr("warning: slow: approach is at t = "));
  EXPECT_THAT(read_text(folder_ / "said"), HasSubstr("an impedance of "));
}

}  // namespace surroundings_test
}  // namespace grapnel
