// Entries of the page over a folder of results.

#include "grapnel/report/index_data.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "report/report_folder.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace index_data_test {

namespace fs = std::filesystem;
using nlohmann::json;
using test::message_of;
using test::put_bytes;
using test::write_run;
using testing::ElementsAre;
using testing::HasSubstr;

struct IndexDataOf : testing::Test {
  test::TemporaryFolder folder;

  json results() const {
    const ReportData data = index_data(folder.path(), folder.path() / "index.html", "1.2.3");
    return json::parse(data.json)["index"]["results"];
  }
  std::vector<std::string> all(const char* key) const {
    std::vector<std::string> values;
    for (const json& one : results()) values.push_back(one[key].get<std::string>());
    return values;
  }
  // Sets the times of results apart, since a test writes them within one second.
  void set_age(const fs::path& file, int seconds) const {
    fs::last_write_time(folder.path() / file, fs::file_time_type::clock::now() - std::chrono::seconds(seconds));
  }
};

TEST_F(IndexDataOf, ListsResultsOfAllKindsTheNewestFirst) {
  write_run(folder.path() / "a" / "first", "one");
  write_run(folder.path() / "second", "two <b>");
  put_bytes(folder.path() / "second" / "report.html", "");
  fs::create_directories(folder.path() / "maps" / "m" / "series" / "case-3");
  put_bytes(folder.path() / "maps" / "m" / "campaign.json",
            R"({"schema": "grapnel-campaign-report/1", "version": "0.1.0", "campaign": {"name": "many"}, "rows": 200,
                "counts": {"success": 196}, "success": {"estimate": 0.98, "lower": 0.95, "upper": 0.992,
                "confidence": 0.95}})");
  write_run(folder.path() / "maps" / "m" / "series" / "case-3", "a case of the campaign");
  fs::create_directories(folder.path() / "s");
  put_bytes(folder.path() / "s" / "study.json",
            R"({"schema": "grapnel-study-table/1", "version": "0.1.0", "study": {"name": "grid"}, "points": 9, "ok": 8,
                "failed": 1, "unreachable": 0})");
  set_age("a/first/summary.json", 10), set_age("second/summary.json", 30);
  set_age("maps/m/campaign.json", 20), set_age("s/study.json", 40);

  EXPECT_THAT(all("title"), ElementsAre("one", "many", "two <b>", "grid"));
  EXPECT_THAT(all("kind"), ElementsAre("run", "campaign", "run", "sweep"));
  EXPECT_THAT(all("path"), ElementsAre("a/first", "maps/m", "second", "s"));
  const json entries = results();
  EXPECT_EQ(entries[0]["report"], false);
  EXPECT_EQ(entries[2]["report"], true);
  EXPECT_EQ(entries[0]["answers"][0]["question"], "Capture");
  EXPECT_EQ(entries[1]["answers"][0]["word"], "98 %");
  EXPECT_EQ(entries[1]["answers"][0]["sentence"], "196 of 200 cases; 95 to 99.2 % at 95 % confidence");
  EXPECT_EQ(entries[3]["answers"][0]["sentence"], "8 completed, 1 failed, 0 unreachable");
  EXPECT_EQ(entries[3]["answers"][0]["tone"], "warn");
}

TEST_F(IndexDataOf, NamesTheErrorOfDamagedResults) {
  write_run(folder.path() / "sound");
  for (const char* name : {"cut", "other"}) fs::create_directories(folder.path() / name);
  put_bytes(folder.path() / "cut" / "summary.json", "{\"schema\": \"grapnel-summary/2\", ");
  put_bytes(folder.path() / "other" / "study.json", R"({"schema": "something/1"})");
  write_run(folder.path() / "mixed");
  put_bytes(folder.path() / "mixed" / "study.json", "{}");
  json by_path;
  for (const json& one : results()) by_path[one["path"].get<std::string>()] = one;
  EXPECT_EQ(by_path["sound"]["fault"], "");
  EXPECT_THAT(by_path["cut"]["fault"].get<std::string>(), HasSubstr("summary.json: not JSON"));
  EXPECT_EQ(by_path["cut"]["title"], "cut");
  EXPECT_THAT(by_path["other"]["fault"].get<std::string>(), HasSubstr("not grapnel-study-table/1"));
  EXPECT_THAT(by_path["mixed"]["fault"].get<std::string>(), HasSubstr("results of several kinds"));
}

TEST_F(IndexDataOf, LinksAreRelativeToThePage) {
  write_run(folder.path() / "runs" / "a");
  const ReportData data = index_data(folder.path() / "runs", folder.path() / "pages" / "all.html", "1.2.3");
  EXPECT_EQ(json::parse(data.json)["index"]["results"][0]["path"], "../runs/a");
  EXPECT_EQ(data.title, "Results in runs");
}

TEST_F(IndexDataOf, FollowsNoLinksAndNeedsResults) {
  EXPECT_EQ(message_of([&] { results(); }),
            folder.path().string() + ": no results in this folder and the folders below it");
  EXPECT_EQ(message_of([&] { index_data(folder.path() / "none", "x", ""); }),
            (folder.path() / "none").string() + ": no such folder");
  write_run(folder.path() / "a");
  fs::create_directory_symlink(folder.path(), folder.path() / "loop");
  EXPECT_EQ(results().size(), 1U);
}

}  // namespace index_data_test
}  // namespace grapnel
