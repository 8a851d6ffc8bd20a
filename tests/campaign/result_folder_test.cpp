// Work on result folders, as a program without a terminal sees it.
#include "grapnel/campaign/result_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/campaign_folder.hpp"
#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace result_folder_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

struct Heard : Listener {
  void message(const Message& message) override { messages.push_back(message); }
  void note(const std::string& lines) override { notes += lines; }
  void phase(const std::string& /*phase*/, double /*at*/, double /*end*/) override { ++progress; }
  void points(const CaseProgress& /*at*/) override { ++progress; }
  void cases(const CaseProgress& /*at*/) override { ++progress; }

  std::vector<Message> messages;
  std::string notes;
  int progress = 0;
};

auto is(Message::Kind kind, const std::string& text) {
  return AllOf(Field(&Message::kind, kind), Field(&Message::text, HasSubstr(text)));
}

std::string case_1() { return test::shipped("scenarios/thesis/open-loop-case-1.yaml"); }
std::string at_contact() { return test::shipped("scenarios/thesis/open-loop-at-contact.yaml"); }

TEST(ResultFolder, ARunWritesItsFiles) {
  const test::Folder folder;
  Heard heard;
  const CaptureProblem problem = load_scenario(case_1());
  EXPECT_EQ(run_scenario(problem, case_1(), folder.path(), {.no_report = true}, heard), Ending::done);
  for (const char* name : {"summary.json", "scene.json", "scenario.json", "timeseries.h5"})
    EXPECT_TRUE(fs::exists(folder.path() / name)) << name;
  EXPECT_FALSE(fs::exists(folder.path() / "report.html"));
  EXPECT_THAT(heard.notes, HasSubstr("results in " + folder.path().string() + ": summary.json, timeseries.h5"));
  EXPECT_GT(heard.progress, 0);
}

TEST(ResultFolder, AStoppedRunLeavesTheResultsSoFar) {
  const test::Folder folder;
  std::stop_source stop;
  stop.request_stop();
  Heard heard;
  const CaptureProblem problem = load_scenario(case_1());
  EXPECT_EQ(run_scenario(problem, "file.yaml", folder.path(),
                         {.quiet = true, .no_report = true, .warnings = {}, .stop = stop.get_token()}, heard),
            Ending::interrupted);
  EXPECT_THAT(heard.messages,
              ::testing::Contains(is(Message::Kind::remark, "file.yaml: stopped; the results so far are in")));
  EXPECT_TRUE(fs::exists(folder.path() / "summary.json"));
  EXPECT_THAT(heard.notes, IsEmpty());
  EXPECT_EQ(heard.progress, 0);
}

TEST(ResultFolder, ASweepTellsOfFailedPoints) {
  const test::Folder folder;
  const fs::path file = folder.write(
      "study.yaml", "name: steps\nscenario: " + test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml") +
                        "\nset: {integration.method: rk4, contact: {gap: weld_as_found}}\naxes:\n"
                        "  - {path: integration.step, values: [0.02, 1.9, 2]}\n");
  Heard heard;
  EXPECT_EQ(run_sweep_folder(load_study(file), folder.path(), {.no_report = true}, heard), Ending::some_failed);
  EXPECT_THAT(heard.messages,
              ::testing::Contains(is(Message::Kind::warning, "study.yaml: warning: 2 of 3 points are not ok")));
  EXPECT_TRUE(fs::exists(folder.path() / "study.json"));
  EXPECT_FALSE(fs::exists(folder.path() / "table.partial.csv"));
}

TEST(ResultFolder, ACampaignResumesAndRefusesTheFolderOfAnother) {
  const test::Folder folder;
  const std::string text =
      "name: masses\nsimulate: impact\ncases: 20\nseed: 1\nscenario: " + at_contact() +
      "\nuncertain:\n  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.8, to: 1.2}}\n";
  const Campaign campaign = load_campaign(folder.write("campaign.yaml", "schema: grapnel-campaign/1\n" + text));
  CampaignFolderOptions options;
  options.threads = 2, options.no_report = true, options.command = "again", options.resume = "grapnel campaign";
  std::stop_source stop;
  stop.request_stop();
  options.stop = stop.get_token();
  Heard heard;
  const fs::path results = folder.path() / "out";
  ASSERT_TRUE(results_folder(results, campaign.file, Outputs::campaign, heard));
  EXPECT_EQ(run_campaign_folder(campaign, results, options, heard), Ending::interrupted);
  EXPECT_THAT(heard.messages, ElementsAre(is(Message::Kind::remark, "0 of 20 cases are kept in " + results.string() +
                                                                        "; to resume: grapnel campaign")));
  options.stop = {};
  heard = {};
  EXPECT_EQ(run_campaign_folder(campaign, results, options, heard), Ending::done);
  EXPECT_THAT(heard.messages, ::testing::Each(Field(&Message::kind, Message::Kind::warning)));
  EXPECT_TRUE(fs::exists(results / "campaign.json") && fs::exists(results / "table.csv"));
  heard = {};
  Campaign other = campaign;
  other.seed = 2;
  EXPECT_EQ(run_campaign_folder(other, results, options, heard), Ending::bad_input);
  ASSERT_EQ(heard.messages.size(), 1u);
  EXPECT_THAT(heard.messages[0], is(Message::Kind::error, "grapnel: error: "));
  EXPECT_FALSE(can_run(campaign, true, heard));  // a map needs a design
}

}  // namespace result_folder_test
}  // namespace grapnel
