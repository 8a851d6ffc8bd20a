// Campaigns in reports.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "grapnel/report/campaign_source.hpp"
#include "grapnel/report/report_data.hpp"
#include "grapnel/result/file_seal.hpp"
#include "report/campaign_folder.hpp"
#include "report/report_folder.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace campaign_data_test {

namespace fs = std::filesystem;
using nlohmann::json;
using test::made_impulse;
using test::made_mass;
using test::MadeCampaign;
using test::message_of;
using test::numbers_from_base64;
using testing::AllOf;
using testing::HasSubstr;

struct CampaignReport : testing::Test {
  test::TemporaryFolder folder;

  json data() const { return json::parse(report_data(folder.path(), "1.2.3").json); }
  json campaign() const { return data()["campaign"]; }
  std::string fault() const {
    return message_of([&] { report_data(folder.path(), "1.2.3"); });
  }
  std::string note() const {
    const json notes = campaign()["notes"];
    EXPECT_EQ(notes.size(), 1u);
    return notes.empty() ? "" : notes[0].get<std::string>();
  }
};

std::vector<double> cases_of(const json& sample) {
  return numbers_from_base64<double>(sample["case"].get<std::string>());
}

TEST_F(CampaignReport, FewCasesAreAllThere) {
  test::write_campaign({}, folder.path());
  EXPECT_EQ(kind_of_results(folder.path()), ResultKind::campaign);
  const json all = data(), c = all["campaign"], sample = c["sample"];
  EXPECT_EQ(all["kind"], "campaign");
  EXPECT_EQ(all["title"], "made up");
  EXPECT_EQ(c["statistics"], json::parse(test::bytes_of(folder / "campaign.json")));
  EXPECT_EQ(c["command"], "grapnel campaign 'studies/my target.yaml' --only {K}");
  EXPECT_EQ(c["rows"], 100);
  EXPECT_EQ(c["notes"], json::array());
  ASSERT_EQ(sample["rows"], 100);
  const std::vector<double> cases = cases_of(sample);
  const auto mass = numbers_from_base64<float>(sample["inputs"][0]["data"].get<std::string>());
  const auto impulse = numbers_from_base64<float>(sample["columns"][1]["data"].get<std::string>());
  const auto status = numbers_from_base64<std::uint8_t>(sample["status"].get<std::string>());
  const auto success = numbers_from_base64<std::uint8_t>(sample["success"].get<std::string>());
  const auto drawn = numbers_from_base64<std::uint8_t>(sample["drawn"].get<std::string>());
  ASSERT_EQ(cases.size(), 100u);
  for (std::size_t k = 0; k < cases.size(); ++k) {
    EXPECT_EQ(cases[k], static_cast<double>(k));
    EXPECT_EQ(mass[k], static_cast<float>(made_mass(k)));
    EXPECT_TRUE(std::isnan(made_impulse(k)) ? std::isnan(impulse[k])
                                            : impulse[k] == static_cast<float>(made_impulse(k)));
    EXPECT_EQ(status[k], k % 50 == 13 ? 1 : 0);
    EXPECT_EQ(success[k], k % 10 == 3 ? 0 : 1);
    EXPECT_EQ(drawn[k], 1);
  }
  EXPECT_EQ(sample["statuses"], (json{"ok", "failed", "unreachable"}));
  EXPECT_EQ(sample["reasons"], (json{{13, "no convergence at t = 3 s"}, {63, "größer als <erlaubt>"}}));
  EXPECT_EQ(sample["columns"][1]["name"], "grasps/tip-1/impulse_magnitude");
  EXPECT_EQ(sample["columns"][1]["unit"], "N s");
}

TEST_F(CampaignReport, SavedCasesAreNamedAndAmongTheRows) {
  MadeCampaign made;
  made.rows = 20'000;
  test::write_campaign(made, folder.path());
  EXPECT_EQ(campaign()["saved"], json::array());
  for (const char* name : {"case-17777", "case-9", "case-x", "other"}) {
    fs::create_directories(folder / "series" / name);
    test::put_bytes(folder / "series" / name / "report.html", "<html>");
  }
  fs::create_directories(folder / "series" / "case-3");  // without a report
  EXPECT_EQ(campaign()["saved"], (json{9, 17777}));
  const std::vector<double> cases = cases_of(campaign()["sample"]);
  EXPECT_EQ(std::count(cases.begin(), cases.end(), 17777.0), 1);
}

TEST_F(CampaignReport, ManyCasesAreThinnedReproducibly) {
  MadeCampaign made;
  made.rows = 200'000;
  test::write_campaign(made, folder.path());
  const auto start = std::chrono::steady_clock::now();
  const std::string first = report_data(folder.path(), "1").json;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  RecordProperty("seconds", std::to_string(seconds));
  EXPECT_EQ(first, report_data(folder.path(), "1").json);
  const json sample = json::parse(first)["campaign"]["sample"];
  const std::vector<double> cases = cases_of(sample);
  const auto drawn = numbers_from_base64<std::uint8_t>(sample["drawn"].get<std::string>());
  EXPECT_EQ(std::count(drawn.begin(), drawn.end(), 1), 5000);
  EXPECT_LE(cases.size(), 5503u);
  EXPECT_TRUE(std::is_sorted(cases.begin(), cases.end()));
  for (const double named : {13.0, 42.0, 199'999.0})
    EXPECT_EQ(std::count(cases.begin(), cases.end(), named), 1) << named;
  // Evenly spread, over the cases and over every pattern in their order: within 5 standard deviations.
  double below = 0, multiples = 0;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (drawn[i] == 0) continue;
    below += cases[i] < 50'000;
    multiples += std::fmod(cases[i], 16) == 0;
  }
  EXPECT_NEAR(below, 1250, 5 * std::sqrt(1250 * 0.75));
  EXPECT_NEAR(multiples, 312.5, 5 * std::sqrt(312.5 * 15 / 16));
}

TEST_F(CampaignReport, WideTablesKeepFewerRows) {
  MadeCampaign made;
  made.rows = 3000;
  test::write_campaign_table(made, folder / "table.h5");
  json statistics = test::campaign_statistics(made);
  const json one = statistics["columns"][0];
  for (int i = 0; i < 500; ++i) statistics["columns"].push_back(one);  // the same again
  test::put_bytes(folder / "campaign.json", statistics.dump());
  const json sample = campaign()["sample"];
  const auto drawn = numbers_from_base64<std::uint8_t>(sample["drawn"].get<std::string>());
  EXPECT_EQ(std::count(drawn.begin(), drawn.end(), 1), 1'000'000 / 505);
}

TEST_F(CampaignReport, WithoutItsTableTheStatisticsAreThere) {
  test::write_campaign({}, folder.path());
  fs::remove(folder / "table.h5");
  EXPECT_THAT(note(), AllOf(HasSubstr("table.h5"), HasSubstr("no such file")));
  EXPECT_TRUE(campaign()["sample"].is_null());
  EXPECT_EQ(campaign()["statistics"]["rows"], 100);
}

TEST_F(CampaignReport, DamagedTablesAreNotes) {
  MadeCampaign made;
  test::write_campaign(made, folder.path());
  const std::string good = test::bytes_of(folder / "table.h5");
  test::put_bytes(folder / "table.h5", good.substr(0, good.size() / 2));
  EXPECT_THAT(note(), HasSubstr("truncated or damaged"));
  test::put_bytes(folder / "table.h5", "no table");
  EXPECT_THAT(note(), HasSubstr("not an HDF5 file"));
  test::put_bytes(folder / "table.h5", good);
  seal_file(folder / "table.h5");
  EXPECT_EQ(campaign()["notes"].size(), 0u);
  std::string flipped = test::bytes_of(folder / "table.h5");
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  test::put_bytes(folder / "table.h5", flipped);
  EXPECT_THAT(note(), HasSubstr("checksum"));
  const auto with = [&](auto change) {
    MadeCampaign other;
    change(other);
    test::write_campaign_table(other, folder / "table.h5");
    return note();
  };
  EXPECT_THAT(with([](MadeCampaign& m) { m.sha256 = "another"; }), HasSubstr("another campaign"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.schema = "x/1"; }), HasSubstr("schema is 'x/1'"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.status_of_row_7 = 5; }), HasSubstr("'status' counts beyond its names"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.reason_of_row_7 = 9; }), HasSubstr("'reasons' has no text number 9"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.reason_of_row_7 = -1; }), HasSubstr("negative"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.short_column = true; }), HasSubstr("another length than 'k'"));
  EXPECT_THAT(with([](MadeCampaign& m) { m.rows = 90; }), HasSubstr("90 rows, but campaign.json has 100"));
}

TEST_F(CampaignReport, StatisticsMustBeSound) {
  test::write_campaign({}, folder.path());
  const std::string good = test::bytes_of(folder / "campaign.json");
  test::put_bytes(folder / "campaign.json", good.substr(0, 40));
  EXPECT_THAT(fault(), HasSubstr("campaign.json"));
  test::put_bytes(folder / "campaign.json", R"({"schema": "grapnel-study/1"})");
  EXPECT_THAT(fault(), AllOf(HasSubstr("campaign.json"), HasSubstr("grapnel-study/1")));
  test::put_bytes(folder / "campaign.json", R"({"schema": "grapnel-campaign-report/1"})");
  EXPECT_THAT(fault(), HasSubstr("list 'inputs' is missing"));
  json statistics = json::parse(good);
  statistics["columns"][0].erase("name");
  test::put_bytes(folder / "campaign.json", statistics.dump());
  EXPECT_THAT(fault(), HasSubstr("an entry of 'columns' lacks the text 'name'"));
}

TEST_F(CampaignReport, HalfOfTheKeysMayBeMissing) {
  MadeCampaign made;
  test::write_campaign(made, folder.path());
  json statistics = json::parse(test::bytes_of(folder / "campaign.json"));
  for (const char* key : {"worst", "reasons", "campaign", "rows", "counts"}) statistics.erase(key);
  test::put_bytes(folder / "campaign.json", statistics.dump());
  const json c = campaign();
  EXPECT_EQ(c["command"], "");
  EXPECT_EQ(c["sample"]["rows"], 100);
  EXPECT_EQ(data()["title"], folder.path().filename().string());
}

TEST(SampledRows, EvenAndAdded) {
  std::vector<std::uint64_t> index;
  std::vector<std::uint8_t> success;
  for (std::uint64_t k = 0; k < 1000; ++k) index.push_back(3 * k), success.push_back(k % 100 == 0 ? 0 : 1);
  CampaignQuery query;
  query.most = 100;
  query.most_without_success = 4;
  query.cases = {3 * 777, 1, 3 * 1000};  // the last two are in no row
  const auto picked = sampled_rows(index, success, query);
  std::set<std::size_t> rows;
  std::size_t even = 0, without = 0;
  for (const auto& [row, drawn] : picked) rows.insert(row), even += drawn, without += success[row] == 0;
  EXPECT_EQ(rows.size(), picked.size()) << "no row twice";
  EXPECT_EQ(even, 100u);
  EXPECT_TRUE(rows.contains(777));
  EXPECT_GE(without, 4u);
  // More rows later leave those that stay where they are: the least hashes of a beginning are among its rows.
  query.most = 2000;
  EXPECT_EQ(sampled_rows(index, success, query).size(), 1000u);
  EXPECT_TRUE(sampled_rows({}, {}, query).empty());
}

}  // namespace campaign_data_test
}  // namespace grapnel
