#include "grapnel/campaign/success_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "campaign/fake_campaign.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace success_map_test {

using test::TemporaryFolder;

Campaign design() {
  Campaign campaign = test::fake_campaign(10);
  campaign.design = {{"speed", "m/s", "", true, {{0.1, ""}, {0.2, ""}, {0.3, ""}}},
                     {"law", "", "", false, {{NAN, "rigid, or so"}, {NAN, "soft"}}}};
  return campaign;
}

// Successes at the points: 10, 8, 6, 4, 2, 0; one case of the second failed, the last point has only four rows.
std::vector<CaseRow> rows() {
  std::vector<CaseRow> all;
  for (std::uint64_t k = 0; k < 54; ++k) {
    CaseRow row = test::fake_row(0);
    row.index = k;
    row.success = k % 10 < 10 - 2 * (k / 10);
    if (k == 19) {
      row.status = CaseStatus::failed;
      row.values.assign(3, NAN);
      row.reason = "no";
    }
    all.push_back(row);
  }
  return all;
}

std::vector<SuccessMapPoint> map_of_design() {
  std::vector<std::uint64_t> index;
  std::vector<std::uint8_t> status, success;
  for (const CaseRow& row : rows()) {
    index.push_back(row.index);
    status.push_back(static_cast<std::uint8_t>(row.status));
    success.push_back(row.success);
  }
  return success_map_of(design(), index, status, success);
}

TEST(SuccessMap, CountsEveryPoint) {
  const std::vector<SuccessMapPoint> points = map_of_design();
  ASSERT_EQ(points.size(), 6u);
  for (std::size_t p = 0; p < 6; ++p) {
    const std::uint64_t trials = p < 5 ? 10 : 4;
    EXPECT_EQ(points[p].success.trials, trials);
    EXPECT_EQ(points[p].ok, p == 1 ? 9 : trials);
    EXPECT_EQ(points[p].success.successes, 10 - 2 * p);
    EXPECT_EQ(points[p].success.lower, wilson(10 - 2 * p, trials).lower);
  }
}

TEST(SuccessMap, KeepsPointsWithoutRows) {
  const std::vector<SuccessMapPoint> points = success_map_of(design(), {}, {}, {});
  ASSERT_EQ(points.size(), 6u);
  EXPECT_TRUE(std::isnan(points[3].success.estimate));
  EXPECT_EQ(points[3].success.upper, 1);
  const std::vector<std::uint64_t> beyond{60};
  const std::vector<std::uint8_t> one{1};
  EXPECT_THROW(success_map_of(design(), beyond, one, one), std::runtime_error);
  EXPECT_TRUE(success_map_of(test::fake_campaign(3), beyond, one, one).empty()) << "without a design";
}

TEST(SuccessMap, HasATextFile) {
  const std::string text = success_map_csv(design(), map_of_design());
  EXPECT_TRUE(text.starts_with(
      "point,speed [m/s],law,trials,ok,successes,estimate,lower,upper,deciding\n0,0.1,\"rigid, or so\",10,10,10,1,"))
      << text;
  EXPECT_NE(text.find("\n1,0.1,soft,10,9,8,0.8,"), std::string::npos);
  EXPECT_NE(text.find("\n5,0.3,soft,4,4,0,0,0,"), std::string::npos);
}

TEST(SuccessMap, IsATableOnATerminal) {
  const std::string text = success_map_summary(design(), map_of_design());
  EXPECT_NE(text.find("speed [m/s] downwards, law to the right"), std::string::npos) << text;
  EXPECT_NE(text.find("rigid, or so  soft"), std::string::npos) << text;
  EXPECT_NE(text.find("100 %  80 %"), std::string::npos) << text;
  Campaign one = design();
  one.design.pop_back();
  const std::vector<SuccessMapPoint> points(3);
  EXPECT_NE(success_map_summary(one, points).find("speed [m/s]"), std::string::npos);
}

TEST(SuccessMap, IsInTheReport) {
  const TemporaryFolder folder;
  const Campaign campaign = design();
  write_campaign_tables(folder.path(), campaign, "1", false, [](const TakeRow& take) {
    for (const CaseRow& row : rows()) take(row);
  });
  const CampaignReport report = analyze_campaign(campaign, CampaignTable(folder.path() / "table.h5"), "1");
  const nlohmann::json document = nlohmann::json::parse(campaign_json(report)), json = document["success_map"];
  EXPECT_THAT(test::contract_faults<CampaignReport>(document), ::testing::IsEmpty());
  EXPECT_EQ(json["axes"][0]["values"], nlohmann::json::parse("[0.1, 0.2, 0.3]"));
  EXPECT_EQ(json["axes"][1]["values"], nlohmann::json::parse(R"(["rigid, or so", "soft"])"));
  EXPECT_EQ(json["successes"], nlohmann::json::parse("[10, 8, 6, 4, 2, 0]"));
  EXPECT_EQ(json["estimate"][1], 0.8);
  EXPECT_EQ(json["unmet"].size(), 1u);
  EXPECT_EQ(json["above"][1]["level"], 0.9);
  EXPECT_NE(campaign_summary(campaign, report).find("probability of success"), std::string::npos);
}

// What the map is coloured by is what the headline counts: the lower end of the interval.
TEST(SuccessMap, ReportsDecisiveCriteriaAndSafePoints) {
  Campaign campaign = test::fake_campaign(100);
  campaign.design = {{"speed", "m/s", "", true, {{0.1, ""}, {0.2, ""}, {0.3, ""}}}};
  const std::vector<std::string> names{"a", "b/x", "b/y", "mass", "spin/x"};
  campaign.success = {Criterion::parse("a < 0.5", names, "slow"), Criterion::parse("b/x < 0.5", names, "soft")};
  const TemporaryFolder folder;
  write_campaign_tables(folder.path(), campaign, "1", false, [&](const TakeRow& take) {
    for (std::uint64_t k = 0; k < 300; ++k) {
      CaseRow row = test::fake_row(0);
      row.index = k;
      const std::uint64_t point = k / 100, i = k % 100;
      row.status = point == 2 && i < 60 ? CaseStatus::failed : CaseStatus::ok;
      // If "soft" fails, "slow" cannot be checked, as impulses without a capture: it does not fail.
      row.values = {point != 1 || i >= 30 ? 0.0 : i < 10 ? 1.0 : NAN, point == 1 && i < 30 ? 1.0 : 0.0, 0};
      row.success = row.status == CaseStatus::ok && row.values[0] < 0.5 && row.values[1] < 0.5;
      take(row);
    }
  });
  const CampaignReport report = analyze_campaign(campaign, CampaignTable(folder.path() / "table.h5"), "1");
  EXPECT_FALSE(report.success_map[0].deciding());
  EXPECT_EQ(report.success_map[1].unmet, (std::vector<std::uint64_t>{10, 30}));
  EXPECT_EQ(deciding_text(campaign, report.success_map[1]), "soft");
  EXPECT_EQ(deciding_text(campaign, report.success_map[2]), "not ok");
  EXPECT_EQ(points_above(report.success_map, 0.9), 1u);
  const std::string text = campaign_summary(campaign, report);
  EXPECT_NE(text.find("1 of 3 points have a probability of success of 0.9 or more (lower end of its 95 % interval)\n"
                      "what fails most often: soft at 1, cases that are not ok at 1"),
            std::string::npos)
      << text;
  EXPECT_NE(success_map_csv(campaign, report.success_map).find(",soft\n"), std::string::npos);
  const nlohmann::json document = nlohmann::json::parse(campaign_json(report)), json = document["success_map"];
  EXPECT_THAT(test::contract_faults<CampaignReport>(document), ::testing::IsEmpty());
  EXPECT_EQ(json["deciding"], nlohmann::json::parse(R"([null, "soft", "not ok"])"));
  EXPECT_EQ(json["unmet"][1]["counts"], nlohmann::json::parse("[0, 30, 0]"));
  EXPECT_EQ(json["above"][1]["points"], 1);
}

TEST(Percentage, HasTheDigitsThatAreKnown) {
  const auto shown = [](std::uint64_t successes, std::uint64_t trials) {
    const Proportion p = wilson(successes, trials);
    return percentage(p.estimate, p);
  };
  EXPECT_EQ(shown(5, 10), "50 %");
  EXPECT_EQ(shown(913, 1000), "91.3 %");
  EXPECT_EQ(shown(99991, 100000), "99.991 %");
  EXPECT_EQ(shown(0, 0), "-");
}

}  // namespace success_map_test
}  // namespace grapnel
