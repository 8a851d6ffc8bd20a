// Plugins that end the program, or disturb it: exit code 1, a line that names the plugin, finished results kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "program_run.hpp"

namespace grapnel {
namespace plugin_end_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;

class PluginEnd : public test::ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    std::string text = read_text(GRAPNEL_SOURCE_DIR "/examples/controllers/own-controller.yaml");
    const auto replace = [&](const std::string& key, const std::string& value) {
      const std::size_t at = text.find(key);
      ASSERT_NE(at, std::string::npos) << key;
      text.replace(at, text.find('\n', at) - at, key + " " + value);
    };
    replace("robot:", GRAPNEL_SOURCE_DIR "/robots/planar-dual-arm.yaml");
    replace("plugin:", GRAPNEL_ENDING_PLUGIN);
    write("mine.yaml", text);
    write("c.yaml",
          "schema: grapnel-campaign/1\nname: a\nscenario: mine.yaml\ncases: 2\nseed: 1\n"
          "set: {post_impact.duration: 1}\n"
          "uncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  }
  void TearDown() override {
    ::unsetenv("GRAPNEL_TEST_END");
    ProgramRun::TearDown();
  }
  Outcome with_end(const std::string& end, const std::string& arguments) const {
    ::setenv("GRAPNEL_TEST_END", end.c_str(), 1);
    return run(arguments);
  }
  static std::ptrdiff_t lines_naming_it(const Outcome& o) {
    std::ptrdiff_t count = 0;
    for (std::size_t at = 0; (at = o.err.find("ending_plugin", at)) != std::string::npos;
         at = std::min(o.err.find('\n', at), o.err.size()))
      ++count;
    return count;
  }
  const std::string run_ = "run mine.yaml --set post_impact.duration=1 --no-report --quiet -o ";
};

TEST_F(PluginEnd, RegularPluginRuns) {
  const Outcome o = run(run_ + "r");
  EXPECT_EQ(o.code, 0) << o.err;
}

TEST_F(PluginEnd, ProcessEndIsNeverSuccess) {
  for (const std::string how : {"exit", "_exit", "quick_exit", "overflow", "crash", "kill", "throw", "thread"}) {
    for (const std::string where : {"load", "create", "update"}) {
      // Of the loader: an exception ends the process, and a thread that ends it waits for the loader.
      if (where == "load" && (how == "throw" || how == "thread")) continue;
      const Outcome o = with_end(where + " " + how, run_ + "r-" + where + how);
      EXPECT_TRUE(o.code == 1 || (o.code == 2 && how == "throw")) << where << " " << how << o.code << "\n" << o.err;
      EXPECT_EQ(lines_naming_it(o), 1) << where << " " << how << "\n" << o.err;
    }
  }
}

TEST_F(PluginEnd, CheckAndCampaignReportIt) {
  for (const std::string how : {"exit", "_exit", "quick_exit", "overflow"}) {
    const Outcome checked = with_end("load " + how, "check mine.yaml");
    EXPECT_EQ(checked.code, 1) << how << checked.out;
    EXPECT_EQ(lines_naming_it(checked), 1) << how << "\n" << checked.err;
    const Outcome drawn = with_end("update " + how, "campaign c.yaml --quiet -j 2 -o c-" + how);
    EXPECT_EQ(drawn.code, 1) << how;
    EXPECT_EQ(lines_naming_it(drawn), 1) << how << "\n" << drawn.err;
  }
}

TEST_F(PluginEnd, FinishedRunIsKept) {
  for (const std::string how : {"exit", "_exit", "quick_exit", "overflow", "crash", "kill", "throw"}) {
    const std::string folder = "r-" + how;
    const Outcome o = with_end("destroy " + how, run_ + folder);
    EXPECT_EQ(o.code, 1) << how << "\n" << o.err;
    EXPECT_EQ(lines_naming_it(o), 1) << how << "\n" << o.err;
    EXPECT_THAT(read_text(folder_ / folder / "summary.json"), HasSubstr("\"completed\"")) << how;
    EXPECT_TRUE(fs::exists(folder_ / folder / "timeseries.h5")) << how;
  }
}

TEST_F(PluginEnd, SweepKeepsPoints) {
  write("s.yaml",
        "name: s\nscenario: mine.yaml\nset: {post_impact.duration: 1}\n"
        "axes: [{path: \"targets[0].mass\", values: [10, 11]}]\n");
  const Outcome o = with_end("destroy throw", "sweep s.yaml --quiet --no-report -o s");
  EXPECT_EQ(o.code, 1);
  EXPECT_EQ(lines_naming_it(o), 1) << o.err;
  EXPECT_THAT(read_text(folder_ / "s" / "table.csv"), HasSubstr("\n1,11,ok,"));
}

// What a plugin does to the process ends with its call.
TEST_F(PluginEnd, FolderRoundingAndTrapsAreRestored) {
  ASSERT_EQ(run(run_ + "r").code, 0);
  const std::string before = read_text(folder_ / "r" / "summary.json");
  for (const std::string where : {"load", "create", "update", "destroy"}) {
    for (const std::string how : {"folder", "rounding", "traps"}) {
      fs::remove_all(folder_ / "again");
      const Outcome o = with_end(where + " " + how, run_ + "again");
      EXPECT_EQ(o.code, 0) << where << " " << how << "\n" << o.err;
      EXPECT_EQ(read_text(folder_ / "again" / "summary.json"), before) << where << " " << how;
    }
  }
}

}  // namespace plugin_end_test
}  // namespace grapnel
