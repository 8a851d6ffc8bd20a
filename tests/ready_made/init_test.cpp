// The command `grapnel init`: its files pass `grapnel check` and run as the output states, and it never overwrites
// files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/program_run.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace init_test {

using test::Outcome;
using test::read_text;
using testing::HasSubstr;

class Init : public test::ProgramRun {};

TEST_F(Init, WritesScenariosThatRun) {
  SKIP_UNDER_SANITIZERS();
  for (const std::string name : {"single-arm", "dual-arm", "closed-loop"}) {
    const Outcome written = run("init " + name);
    ASSERT_EQ(written.code, 0) << written.err;
    EXPECT_EQ(written.out, name + ".yaml\nnext: grapnel run " + name + ".yaml\n");
    const Outcome checked = run("check " + name + ".yaml");
    EXPECT_EQ(checked.code, 0) << checked.err;
    EXPECT_EQ(checked.err, "") << name;
    const Outcome ran = run("run " + name + ".yaml --no-report");
    EXPECT_EQ(ran.code, 0) << ran.out << ran.err;
    const auto summary = nlohmann::json::parse(read_text(folder_ / "out" / name / "summary.json"));
    EXPECT_EQ(summary["capture"]["captured"], "yes") << name;
    EXPECT_EQ(summary["ledger"]["feasible"], "yes") << name;
  }
}

TEST_F(Init, WritesACampaignWithItsScenario) {
  SKIP_UNDER_SANITIZERS();
  ASSERT_EQ(run("init campaign -o mine.yaml").code, 0);
  EXPECT_THAT(read_text(folder_ / "mine.yaml"), HasSubstr("\nscenario: mine-scenario.yaml\n"));
  EXPECT_THAT(read_text(folder_ / "mine.yaml"), HasSubstr("grapnel campaign mine.yaml --only 7"));
  EXPECT_EQ(run("check mine-scenario.yaml").code, 0);
  const Outcome ran = run("campaign mine.yaml --no-report");
  EXPECT_EQ(ran.code, 0) << ran.out << ran.err;
  const auto report = nlohmann::json::parse(read_text(folder_ / "out" / "mine" / "campaign.json"));
  EXPECT_GT(report["success"]["estimate"].get<double>(), 0.5);
}

TEST_F(Init, WritesARobot) {
  const Outcome written = run("init robot -o 'my servicer.yaml'");
  ASSERT_EQ(written.code, 0) << written.err;
  EXPECT_THAT(written.out, HasSubstr("next: grapnel info 'my servicer.yaml'\n"));
  const Outcome info = run("info 'my servicer.yaml'");
  EXPECT_EQ(info.code, 0);
  EXPECT_EQ(info.err, "");
  EXPECT_THAT(info.out, HasSubstr("mass 325 kg"));
}

TEST_F(Init, NeverOverwrites) {
  write("single-arm.yaml", "mine\n");
  const Outcome o = run("init");
  EXPECT_EQ(o.code, 2);
  EXPECT_EQ(o.err, "grapnel: error: single-arm.yaml already exists; name another file with -o, or remove it\n");
  EXPECT_EQ(read_text(folder_ / "single-arm.yaml"), "mine\n");
  write("b-scenario.yaml", "mine\n");
  EXPECT_EQ(run("init campaign -o b.yaml").code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b.yaml"));
  EXPECT_EQ(run("init -o nowhere/a.yaml").code, 2);
}

TEST_F(Init, ListsAvailableItems) {
  const Outcome o = run("init --list");
  EXPECT_EQ(o.code, 0);
  for (const ReadyMade& one : all_ready_made()) {
    if (one.name == "campaign-scenario") continue;
    EXPECT_THAT(o.out, HasSubstr("  " + std::string(one.name) + " "));
    EXPECT_THAT(o.out, HasSubstr(one.description() + "\n"));
  }
  const Outcome unknown = run("init dual");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_EQ(unknown.err, "grapnel: error: no ready-made template 'dual'; did you mean 'dual-arm'?\n");
}

TEST_F(Init, InfoKnowsTheNames) {
  for (const ReadyMade& one : all_ready_made()) {
    if (one.kind == ReadyMade::Kind::templates) continue;
    if (test::kSanitized && one.kind == ReadyMade::Kind::robots) continue;  // one process each
    const Outcome o = run("info " + std::string(one.name));
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(o.err, "") << one.name;
    EXPECT_THAT(o.out, HasSubstr("mass ")) << one.name;
  }
  EXPECT_EQ(run("info ets-8").code, 2);
  EXPECT_THAT(run("info envisat").err, HasSubstr("did you mean 'envisat-class'?"));
}

}  // namespace init_test
}  // namespace grapnel
