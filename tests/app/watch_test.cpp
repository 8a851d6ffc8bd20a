// --watch: the live page of a run and of a campaign, in progress and at their end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "http_client.hpp"
#include "program_run.hpp"

namespace grapnel {
namespace watch_test {

namespace fs = std::filesystem;
using nlohmann::json;
using test::read_text;
using test::request;
using testing::HasSubstr;

class WatchedProgram : public test::ProgramRun {
 protected:
  // Starts the program, and waits for the address of its page.
  void start(const std::string& arguments) {
    child_ = fork();
    if (child_ == 0) {
      const std::string line =
          "cd '" + folder_.string() + "' && exec '" GRAPNEL_PROGRAM "' " + arguments + " >said 2>complaints";
      execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
      _exit(127);
    }
    for (int i = 0; i < 600 && address_.empty(); ++i) {
      pause();
      const std::string said = read_text(folder_ / "said"), mark = "live page: ";
      if (const std::size_t at = said.find(mark); at != std::string::npos && said.find('\n', at) != std::string::npos)
        address_ = said.substr(at + mark.size(), said.find('\n', at) - at - mark.size());
    }
    ASSERT_THAT(address_, HasSubstr("http://127.0.0.1:")) << read_text(folder_ / "complaints");
  }
  void TearDown() override {
    if (child_ > 0) kill(child_, SIGKILL), waitpid(child_, nullptr, 0);
    ProgramRun::TearDown();
  }
  static void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(50)); }
  json state() const {
    const test::HttpReply reply = request("GET", address_ + "state");
    EXPECT_EQ(reply.status, 200);
    return reply.status == 200 ? json::parse(reply.body) : json();
  }
  // The state once `holds` does; null after 60 s.
  template <class Condition>
  json state_when(Condition holds) const {
    for (int i = 0; i < 1200; ++i) {
      json now = state();
      if (now.is_null() || holds(now)) return now;
      pause();
    }
    return {};
  }
  int code() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  pid_t child_ = 0;
  std::string address_;
};

TEST_F(WatchedProgram, RunShowsPhasesAndSamplesAndStops) {
  start("run '" + scenario("thesis/open-loop-case-1.yaml") +
        "' --set post_impact.duration=5e4 --set output.interval=0.01 --no-report -o r --watch");
  ASSERT_FALSE(HasFatalFailure());
  const test::HttpReply page = request("GET", address_);
  EXPECT_THAT(page.head, HasSubstr("text/html"));
  EXPECT_THAT(page.body, HasSubstr("connect-src 'self'"));
  const json now = state_when([](const json& s) { return s["samples"] > 3000 && s["phases"].size() > 1; });
  ASSERT_FALSE(now.is_null());
  EXPECT_TRUE(now["ending"].is_null());
  EXPECT_EQ(now["unit"], "");
  EXPECT_GT(now["phases"].back()["at"], now["phases"].back()["from"]);
  const json series = json::parse(request("GET", address_ + "series").body);
  EXPECT_LE(series["samples"], 2000);
  EXPECT_GT(series["of"], 500);
  EXPECT_EQ(request("POST", address_ + "stop").status, 200);
  EXPECT_EQ(state_when([](const json& s) { return !s["ending"].is_null(); })["ending"], "stopped");
  EXPECT_EQ(code(), 130);
  EXPECT_TRUE(fs::exists(folder_ / "r" / "summary.json"));
  EXPECT_THAT(read_text(folder_ / "complaints"), HasSubstr("stopped; the results so far are in r"));
}

TEST_F(WatchedProgram, CampaignSendsItsCountsAndThenItsReport) {
  write("c.yaml", "name: masses\nscenario: " GRAPNEL_SOURCE_DIR
                  "/scenarios/thesis/open-loop-case-1-planned.yaml\nsimulate: impact\ncases: 300\nseed: 1\n"
                  "uncertain: [{path: targets.target-1.mass, as: factor, uniform: {from: 0.9, to: 1.1}}]\n"
                  "success: [captured]\n");
  start("campaign c.yaml -o r -j 2 --watch");
  ASSERT_FALSE(HasFatalFailure());
  const json end = state_when([](const json& s) { return !s["ending"].is_null(); });
  ASSERT_FALSE(end.is_null());
  EXPECT_EQ(end["ending"], "done") << read_text(folder_ / "complaints");
  EXPECT_EQ(end["unit"], "case");
  EXPECT_EQ(end["total"], 300);
  EXPECT_EQ(end["history"].back()[1], 300);
  EXPECT_TRUE(end["report"]);
  EXPECT_EQ(request("GET", address_).body, read_text(folder_ / "r" / "report.html"));
  EXPECT_EQ(code(), 0);
}

TEST_F(WatchedProgram, EndsAtOnceWithoutAPage) {
  const test::Outcome o = run("run '" + scenario("thesis/open-loop-case-1.yaml") + "' -o r --watch");
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("live page: http://127.0.0.1:"));
  EXPECT_THAT(o.out, HasSubstr("results in r"));
  EXPECT_EQ(run("run x.yaml --watch --quiet").code, 2);
}

}  // namespace watch_test
}  // namespace grapnel
