// Long commands that are asked to stop: exit code 130, and what is complete is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "program_run.hpp"

namespace grapnel {
namespace stop_test {

namespace fs = std::filesystem;
using test::read_text;
using testing::HasSubstr;
using testing::StartsWith;

class Stop : public test::ProgramRun {
 protected:
  pid_t start(const std::string& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    ::signal(SIGINT, SIG_DFL);
    const std::string line = "cd '" + folder_.string() + "' && exec '" GRAPNEL_PROGRAM "' " + arguments + " >said 2>&1";
    execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    _exit(127);
  }
  // Its exit code after the signal; -1: it ended by the signal, or not within half a minute.
  static int end_by(pid_t child, int signal) {
    kill(child, signal);
    int status = 0;
    for (int i = 0; i < 600; ++i) {
      if (waitpid(child, &status, WNOHANG) == child) return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return -1;
  }
  static void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(1500)); }
  void optimization(const std::string& set) const {
    write("o.yaml", "name: angle\nscenario: " GRAPNEL_SOURCE_DIR
                    "/scenarios/thesis/open-loop-case-1-planned.yaml\nsimulate: impact\n"
                    "set: {approach.plan.starts: 1, 'grasps.tip-1.relative_velocity': [0, -0.1, 0]" +
                        set +
                        "}\nminimize: grasps/tip-1/impulse_magnitude\n"
                        "variables: [{quantity: approach_angle, grasp: tip-1, from: -10, to: 30, unit: deg}]\n"
                        "search: {evaluations: 200000, refine: 1}\n");
  }
  std::size_t lines_of(const std::string& file) const {
    const std::string text = read_text(folder_ / file);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
};

TEST_F(Stop, OptimizationKeepsEvaluationsAndBest) {
  optimization("");
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(folder_ / "r");
    const pid_t child = start("optimize o.yaml -o r -j 2 --quiet");
    pause();
    pause();
    EXPECT_EQ(end_by(child, signal), 130);
    EXPECT_THAT(read_text(folder_ / "said"), HasSubstr("o.yaml: stopped: "));
    EXPECT_THAT(read_text(folder_ / "said"),
                HasSubstr(" of 200000 evaluations are kept in r/evaluations.csv; the best of "
                          "them is r/best.yaml"));
    EXPECT_GT(lines_of("r/evaluations.csv"), 2u);
    EXPECT_THAT(read_text(folder_ / "r" / "best.yaml"), StartsWith("# Made by grapnel "));
    EXPECT_EQ(run("check r/best.yaml").code, 0);
    EXPECT_FALSE(fs::exists(folder_ / "r" / "comparison.json"));
  }
}

TEST_F(Stop, SweepKeepsPoints) {
  write("s.yaml", "name: long\nscenario: " GRAPNEL_SOURCE_DIR
                  "/scenarios/thesis/closed-loop.yaml\n"
                  "simulate: impact\naxes:\n  - {quantity: relative_speed, from: 0, to: 1, count: 100000}\n");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    fs::remove_all(folder_ / "r");
    const pid_t child = start("sweep s.yaml -o r -j 2 --quiet");
    for (int i = 0; i < 600 && lines_of("r/table.partial.csv") < 3; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(end_by(child, signal), 130);
    EXPECT_THAT(read_text(folder_ / "said"), HasSubstr(" of 100000 points are kept in r/table.partial.csv"));
    EXPECT_GT(lines_of("r/table.partial.csv"), 2u);
  }
}

// What is neither a run nor a study ends with the same code.
TEST_F(Stop, EveryCommandEndsWithTheDocumentedCode) {
  ASSERT_EQ(::mkfifo((folder_ / "fifo.mtx").c_str(), 0600), 0);
  ASSERT_EQ(std::system(("cd '" + folder_.string() + "' && (sleep 30 > fifo.mtx & echo $! > sleeper)").c_str()), 0);
  const pid_t waits = start("modes --mass fifo.mtx --stiffness fifo.mtx --units m-kg-s");
  pause();
  EXPECT_EQ(end_by(waits, SIGTERM), 130);
  [[maybe_unused]] const int ended = std::system(("kill $(cat '" + (folder_ / "sleeper").string() + "')").c_str());
}

TEST_F(Stop, CompleteRunOfCaseIsStopped) {
  write("s.yaml", "name: long\nscenario: " GRAPNEL_SOURCE_DIR
                  "/scenarios/thesis/open-loop-case-1.yaml\nset: {post_impact.duration: 1e6, output.interval: 1e3}\n"
                  "axes: [{path: \"targets[0].mass\", values: [10, 11]}]\n");
  const pid_t child = start("sweep s.yaml --only 1 -o r --quiet --no-report");
  pause();
  EXPECT_EQ(end_by(child, SIGTERM), 130);
}

}  // namespace stop_test
}  // namespace grapnel
