#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "campaign/fake_campaign.hpp"
#include "campaign/plain_statistics.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace report_test {

using Json = nlohmann::json;
using test::fake_campaign;
using test::TemporaryFolder;

constexpr std::uint64_t kRows = 6000;

// a = mass plus noise; b/x = 0 or 1; b/y always 5. Fails at every 100th case.
std::vector<CaseRow> sample_rows() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  std::vector<CaseRow> rows;
  for (std::uint64_t k = 0; k < kRows; ++k) {
    CaseRow row;
    row.index = k;
    row.inputs = {uniform(random), normal(random)};
    row.status = k % 100 == 17 ? CaseStatus::failed : k % 1000 == 5 ? CaseStatus::unreachable : CaseStatus::ok;
    if (row.status == CaseStatus::ok) {
      row.values = {row.inputs[0] + 0.1 * normal(random), row.inputs[1] > 0 ? 1.0 : 0.0, 5};
    } else {
      row.values.assign(3, NAN);
      row.reason = row.status == CaseStatus::failed ? "arm-2 stops at t = " + std::to_string(uniform(random)) + " s"
                                                    : "tip-1 is 0.5 m short";
    }
    rows.push_back(row);
  }
  return rows;
}

Campaign sample_campaign() {
  Campaign campaign = fake_campaign(kRows);
  const std::vector<std::string> names{"a", "b/x", "b/y", "mass", "spin/x"};
  campaign.success = {Criterion::parse("a < 0.8", names, "soft"), Criterion::parse("b/x and abs(spin/x) < 2", names)};
  campaign.series = {0, 0, 4, "a"};
  campaign.file = "studies/it's.yaml";
  return campaign;
}

struct Analyzed {
  Campaign campaign;
  std::vector<CaseRow> rows;
  CampaignReport report;
  Json json;
  std::string text;
};

Analyzed analyzed(Campaign campaign, std::vector<CaseRow> rows) {
  const TemporaryFolder folder;
  for (CaseRow& row : rows) {
    std::vector<double> numbers = row.values;
    numbers.insert(numbers.end(), row.inputs.begin(), row.inputs.end());
    row.success = row.status == CaseStatus::ok;
    for (const Criterion& criterion : campaign.success) row.success = row.success && criterion.holds(numbers);
  }
  write_campaign_tables(folder.path(), campaign, "1", false, [&](const TakeRow& take) {
    for (const CaseRow& row : rows) take(row);
  });
  const CampaignTable table(folder.path() / "table.h5");
  const CampaignReport report = analyze_campaign(campaign, table, "1.2.3");
  const std::string text = campaign_json(report);
  EXPECT_EQ(campaign_json(analyze_campaign(campaign, table, "1.2.3", 3)), text);  // on three threads
  EXPECT_THAT(test::contract_faults<CampaignReport>(Json::parse(text)), ::testing::IsEmpty());
  return {campaign, rows, report, Json::parse(text), text};
}

const Analyzed& sample() {
  static const Analyzed result = analyzed(sample_campaign(), sample_rows());
  return result;
}

TEST(CampaignReport, CountsOutcomes) {
  const Json& json = sample().json;
  EXPECT_EQ(json["schema"], "grapnel-campaign-report/1");
  EXPECT_EQ(json["version"], "1.2.3");
  EXPECT_EQ(json["campaign"]["seed"], "7");
  EXPECT_EQ(json["campaign"]["sampling"], "random");
  EXPECT_EQ(json["campaign"]["plan"], "nominal");
  EXPECT_EQ(json["rows"], kRows);
  EXPECT_EQ(json["counts"]["failed"], 60);
  EXPECT_EQ(json["counts"]["unreachable"], 6);
  EXPECT_EQ(json["counts"]["ok"], kRows - 66);
  std::uint64_t success = 0;
  for (const CaseRow& row : sample().rows) success += row.success;
  ASSERT_GT(success, 1000u);
  EXPECT_EQ(json["counts"]["success"], success);
  const Proportion p = wilson(success, kRows);
  EXPECT_EQ(json["success"]["estimate"], p.estimate);
  EXPECT_EQ(json["success"]["lower"], p.lower);
  EXPECT_EQ(json["success"]["confidence"], 0.95);
}

TEST(CampaignReport, ReportsCasesLostPerCriterion) {
  std::uint64_t soft = 0, only_soft = 0;
  for (const CaseRow& row : sample().rows) {
    if (row.status != CaseStatus::ok) continue;
    const bool other = row.values[1] != 0 && std::abs(row.inputs[1]) < 2;
    soft += row.values[0] < 0.8;
    only_soft += other && !(row.values[0] < 0.8);
  }
  const Json& criteria = sample().json["criteria"];
  ASSERT_EQ(criteria.size(), 2u);
  EXPECT_EQ(criteria[0]["name"], "soft");
  EXPECT_EQ(criteria[0]["text"], "a < 0.8");
  EXPECT_EQ(criteria[0]["met"], soft);
  EXPECT_EQ(criteria[0]["only_this"], only_soft);
  ASSERT_GT(only_soft, 100u);
  EXPECT_EQ(criteria[0]["limits"], Json::parse(R"([{"name": "a", "at_most": 0.8, "magnitude": false}])"));
  EXPECT_EQ(criteria[1]["reads"], Json::parse(R"(["b/x", "spin/x"])"));
  EXPECT_EQ(criteria[1]["limits"], Json::parse(R"([{"name": "spin/x", "at_most": 2.0, "magnitude": true}])"));
}

TEST(CampaignReport, DescribesEveryNumber) {
  std::vector<double> a;
  for (const CaseRow& row : sample().rows) a.push_back(row.values[0]);
  const Description d = test::describe_numbers(a, sample().campaign.quantiles);
  const Json& column = sample().json["columns"][0];
  EXPECT_EQ(column["name"], "a");
  EXPECT_EQ(column["unit"], "N s");
  EXPECT_EQ(column["count"], d.count);
  EXPECT_EQ(column["missing"], 66);
  EXPECT_EQ(column["mean"], d.mean);
  ASSERT_EQ(column["quantiles"].size(), 7u);
  EXPECT_EQ(column["quantiles"][3]["probability"], 0.5);
  EXPECT_EQ(column["quantiles"][3]["value"], d.quantiles[3].value);
  EXPECT_EQ(column["quantiles"][6]["upper"], d.quantiles[6].upper);
  const Json& h = column["histogram"];
  std::uint64_t counted = 0, succeeded = 0;
  for (std::size_t i = 0; i < h["counts"].size(); ++i) {
    counted += h["counts"][i].get<std::uint64_t>();
    succeeded += h["successes"][i].get<std::uint64_t>();
    EXPECT_LE(h["successes"][i], h["counts"][i]);
  }
  EXPECT_EQ(counted, d.count);
  EXPECT_EQ(succeeded, sample().json["counts"]["success"]);
  EXPECT_EQ(sample().json["columns"][2]["histogram"]["counts"], Json::parse("[5934]")) << "always the same";
}

TEST(CampaignReport, ShowsSuccessByInput) {
  const Json& by = sample().json["inputs"][0]["success_by"];
  ASSERT_EQ(by["trials"].size(), 20u);
  std::uint64_t trials = 0, successes = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    trials += by["trials"][i].get<std::uint64_t>();
    successes += by["successes"][i].get<std::uint64_t>();
    EXPECT_LE(by["from"][i], by["to"][i]);
  }
  EXPECT_EQ(trials, kRows);
  EXPECT_EQ(successes, sample().json["counts"]["success"]);
  EXPECT_GT(by["successes"][0], 5 * by["successes"][19].get<int>()) << "light targets are captured";
}

TEST(CampaignReport, RanksInfluentialInputs) {
  const Json& sensitivity = sample().json["sensitivity"];
  EXPECT_EQ(sensitivity["inputs"], Json::parse(R"(["mass", "spin/x"])"));
  const Json& measures = sensitivity["measures"];
  ASSERT_EQ(measures.size(), 5u) << "success, two criteria, a, b/x; b/y never changes";
  EXPECT_EQ(measures[0]["name"], "success");
  EXPECT_EQ(measures[0]["of"], "success");
  EXPECT_EQ(measures[0]["count"], kRows);
  EXPECT_EQ(measures[1]["name"], "soft");
  EXPECT_EQ(measures[1]["of"], "criterion");
  EXPECT_EQ(measures[1]["count"], kRows - 66) << "where the case is ok";
  EXPECT_GT(measures[1]["first_order"][0].get<double>(), 0.5);
  EXPECT_LT(measures[1]["first_order"][1].get<double>(), 0.05) << "the spin decides the other criterion";
  EXPECT_GT(measures[2]["first_order"][1].get<double>(), 0.5);
  EXPECT_EQ(measures[3]["name"], "a");
  EXPECT_EQ(measures[3]["of"], "column");
  const double share = (1.0 / 12) / (1.0 / 12 + 0.01);
  EXPECT_NEAR(measures[3]["first_order"][0].get<double>(), share, 0.02);  // measured 0.0015
  EXPECT_NEAR(measures[3]["first_order"][1].get<double>(), 0, 0.02);      // measured 0.0043
  EXPECT_NEAR(measures[3]["unexplained"].get<double>(), 1 - share, 0.03);
  EXPECT_NEAR(measures[4]["first_order"][1].get<double>(), 1, 0.02);
  EXPECT_LT(measures[0]["rank_correlation"][0].get<double>(), -0.2);
  EXPECT_EQ(sensitivity["left_out"], 0);
}

// An input that is an offset to the design value; the report shows the sum.
TEST(CampaignReport, InfluenceOfAnInputIsNotTheDesigns) {
  constexpr std::uint64_t kPoints = 5, kCases = 1000;
  Campaign campaign = fake_campaign(kCases);
  campaign.design = {{"angle", "rad", "", true, {{0, ""}, {10, ""}, {20, ""}, {30, ""}, {40, ""}}}};
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> first, second;
  for (std::uint64_t k = 0; k < kCases; ++k) first.push_back(normal(random)), second.push_back(normal(random));
  std::vector<CaseRow> rows;
  for (std::uint64_t k = 0; k < kPoints * kCases; ++k) {
    const double design = 10 * static_cast<double>(k / kCases), x = first[k % kCases], y = second[k % kCases];
    CaseRow row;
    row.index = k;
    row.inputs = {design + x, y};
    row.values = {x, design + 0.01 * y, y};
    row.status = CaseStatus::ok;
    rows.push_back(row);
  }
  const Analyzed a = analyzed(campaign, rows);
  const auto index = [&](const std::string& name, std::size_t input) {
    for (const CampaignReport::Measure& measure : a.report.measures) {
      if (measure.name == name) return measure.inputs[input].first_order;
    }
    ADD_FAILURE() << name;
    return 0.0;
  };
  EXPECT_GT(index("a", 0), 0.9) << "the offset alone decides";
  EXPECT_LT(std::abs(index("b/x", 0)), 0.05) << "the design alone decides";
  EXPECT_GT(index("b/y", 1), 0.9);
  // The design axis is one of the sensitivity groups.
  ASSERT_EQ(a.report.groups.size(), 3u);
  EXPECT_EQ(a.report.groups[2].name, "angle");
  for (const CampaignReport::Measure& measure : a.report.measures) {
    if (measure.name == "b/x") {
      EXPECT_GT(measure.groups[2].first_order, 0.95);
    } else if (measure.name == "a") {
      EXPECT_LT(std::abs(measure.groups[2].first_order), 0.05);
    }
  }
  EXPECT_NEAR(a.report.inputs[0].description.mean, 20, 0.1) << "shown unchanged";
}

// A campaign with one grasp, which closes if both tolerances are satisfied.
struct Grasping {
  Campaign campaign = fake_campaign(1000);
  std::vector<CaseRow> rows;

  explicit Grasping(bool judged = true) {
    campaign.columns = {{"captured", "1", "", {}},
                        {"captured/judged", "1", "", {}},
                        {"grasps/tip-1/captured", "1", "", {}},
                        {"grasps/tip-1/impulse", "N s", "", {}},
                        {"noise", "N s", "", {}},
                        {"feasible", "1", "", {}}};
    if (judged) {
      campaign.columns.push_back({"grasps/tip-1/tolerance_used/position", "1", "", {}});
      campaign.columns.push_back({"grasps/tip-1/tolerance_used/velocity", "1", "", {}});
    }
    campaign.inputs.clear();
    for (const char* place : {"position/x", "position/y", "position/z", "rpy/x", "rpy/y", "rpy/z"})
      campaign.inputs.push_back({std::string("targets.box.grasp_points.grip.") + place, "m", ""});
    campaign.inputs.push_back({"targets.box.mass", "kg", ""});
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (std::uint64_t k = 0; k < 1000; ++k) {
      CaseRow row;
      row.index = k;
      for (int i = 0; i < 7; ++i) row.inputs.push_back(normal(random));
      const std::vector<double>& x = row.inputs;
      const double position = std::hypot(x[0], x[1], x[2]) / 2, velocity = std::abs(x[6]) / 2;
      const bool closes = !judged || (position <= 1 && velocity <= 1);
      row.status = CaseStatus::ok;
      const double impulse = closes ? 3 + x[6] + 0.1 * x[0] * x[1] : NAN;
      row.values = {double(closes), double(judged), double(closes), impulse, 1e-16 * x[6], NAN};
      if (judged) row.values.insert(row.values.end(), {position, velocity});
      rows.push_back(row);
    }
  }
  Analyzed with(const std::vector<std::string>& criteria) {
    std::vector<std::string> names;
    for (const Column& column : campaign.columns) names.push_back(column.name);
    for (const CampaignInput& input : campaign.inputs) names.push_back(input.name);
    campaign.success.clear();
    for (const std::string& text : criteria) campaign.success.push_back(Criterion::parse(text, names));
    return analyzed(campaign, rows);
  }
};

TEST(CampaignReport, LostGraspsAreAKindOfTheirOwn) {
  Grasping grasping;
  grasping.campaign.columns.push_back({"grasps/tip-1/lost", "s", "", {}});
  std::uint64_t lost = 0;
  for (CaseRow& row : grasping.rows) {
    const bool loses = row.values[0] == 1 && row.index % 2 == 0;
    if (loses) row.values[0] = row.values[2] = 0;
    row.values.push_back(loses ? 3.0 : NAN);
    lost += loses;
  }
  ASSERT_GT(lost, 50u);
  const Analyzed a = grasping.with({"captured"});
  std::uint64_t counted = 0;
  for (const Json& failure : a.json["failures"]) {
    if (failure["reason"] == "not met: captured (tip-1 loses its target)") counted = failure["count"];
  }
  EXPECT_EQ(counted, lost);
}

TEST(CampaignReport, CountsReasonsForFailure) {
  Grasping grasping;
  grasping.rows[7].status = CaseStatus::failed;
  grasping.rows[7].reason = "conservation check failed: energy_drift 1e-3, at most 1e-10";
  grasping.rows[8].status = CaseStatus::failed;
  grasping.rows[8].reason = "conservation check failed: linear_momentum_drift 1e-5, at most 1e-11";
  std::uint64_t position = 0, velocity = 0, missed = 0;
  for (const CaseRow& row : grasping.rows) {
    if (row.status != CaseStatus::ok || row.values[0] == 1) continue;
    ++missed;
    ++(row.values[6] > row.values[7] ? position : velocity);
  }
  ASSERT_GT(position, 50u);
  ASSERT_GT(velocity, 10u);
  const Analyzed a = grasping.with({"captured"});
  const Json& failures = a.json["failures"];
  ASSERT_EQ(failures.size(), 3u) << failures;
  EXPECT_EQ(failures[0]["reason"], "not met: captured (tip-1 misses by position)");
  EXPECT_EQ(failures[0]["status"], "ok");
  EXPECT_EQ(failures[0]["count"], position);
  EXPECT_EQ(failures[0]["examples"].size(), 3u);
  EXPECT_EQ(failures[1]["reason"], "not met: captured (tip-1 misses by velocity)");
  EXPECT_EQ(failures[1]["count"], velocity);
  EXPECT_EQ(failures[2]["reason"], "conservation check failed") << "whatever row failed";
  EXPECT_EQ(failures[2]["count"], 2);
  EXPECT_EQ(a.json["counts"]["success"], 1000 - missed - 2) << "every other case is in one of them";
  const Json& grasp = a.json["grasps"][0];
  EXPECT_EQ(grasp["end_effector"], "tip-1");
  EXPECT_EQ(grasp["missed"], missed);
  EXPECT_EQ(grasp["tolerances"][0]["name"], "position");
  EXPECT_EQ(grasp["tolerances"][0]["limiting"], position);
  EXPECT_GE(grasp["tolerances"][1]["exceeded"], velocity);
  const std::string text = campaign_summary(a.campaign, a.report);
  EXPECT_NE(text.find(std::to_string(position) + " × not met: captured (tip-1 misses by position) (case"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("tip-1: " + std::to_string(missed) + " of 998 miss, most by position " +
                      std::to_string(position) + ", velocity " + std::to_string(velocity)),
            std::string::npos)
      << text;
  EXPECT_TRUE(a.json["warnings"].empty()) << a.json["warnings"];
}

TEST(CampaignReport, WarnsAboutLimitsOfSuccess) {
  const auto warnings = [](const Analyzed& a) {
    std::string all;
    for (const std::string& one : a.report.warnings) all += one + "\n";
    return all;
  };
  Grasping judged, assumed(false);
  const Analyzed certain = judged.with({"captured", "grasps/tip-1/impulse > -50", "grasps/tip-1/impulse > 50"});
  EXPECT_NE(warnings(certain).find("'grasps/tip-1/impulse > 50' never holds"), std::string::npos) << warnings(certain);
  const Analyzed always = judged.with({"grasps/tip-1/captured < 5"});
  EXPECT_EQ(
      warnings(always),
      "criterion 'grasps/tip-1/captured < 5' never fails: all 1000 cases that are ok meet it, so it has no effect\n");
  const Analyzed all_assumed = assumed.with({"captured"});
  EXPECT_EQ(all_assumed.json["success"]["assumed"], 1000);
  EXPECT_EQ(warnings(all_assumed),
            "in all successes the grasps are assumed to close: end-effectors without an 'envelope' hold without a "
            "check of position and velocity\n");
  EXPECT_NE(campaign_summary(all_assumed.campaign, all_assumed.report)
                .find("1000 cases, all assumed to hold without an envelope\n"),
            std::string::npos);
  const Analyzed unchecked = judged.with({"captured", "feasible"});
  EXPECT_EQ(unchecked.json["criteria"][1]["not_checked"], 1000);
  EXPECT_EQ(unchecked.json["counts"]["success"], 0);
  EXPECT_NE(warnings(unchecked).find("'feasible' was not checked in "), std::string::npos) << warnings(unchecked);
  EXPECT_NE(campaign_summary(unchecked.campaign, unchecked.report).find("× not checked: feasible (case"),
            std::string::npos);
  const Analyzed none = judged.with({});
  EXPECT_NE(warnings(none).find("no criteria are given: every completed case"), std::string::npos);
}

// Without a capture there is no impulse to check: the missed capture is decisive.
TEST(CampaignReport, UncheckedCriteriaDoNotHideFailedOnes) {
  Grasping grasping;
  std::uint64_t missed = 0, hard = 0;
  for (const CaseRow& row : grasping.rows) {
    missed += row.values[0] == 0;
    hard += row.values[0] == 1 && row.values[3] >= 4;
  }
  ASSERT_GT(missed, 100u);
  ASSERT_GT(hard, 10u);
  const Analyzed a = grasping.with({"captured", "grasps/tip-1/impulse < 4"});
  EXPECT_EQ(a.json["criteria"][0]["only_this"], missed);
  EXPECT_EQ(a.json["criteria"][1]["only_this"], hard);
  EXPECT_EQ(a.json["criteria"][1]["not_checked"], missed);
  const std::string text = campaign_summary(a.campaign, a.report);
  const std::string line = "\n  captured: targets.box.grasp_points.grip ";
  EXPECT_NE(text.find(line), std::string::npos) << text;
  EXPECT_EQ(text.find(line), text.rfind(line)) << "a criterion that is a column is listed once\n" << text;
}

TEST(CampaignReport, SixCoordinatesOfAGraspPointAreOneInput) {
  const Analyzed a = Grasping().with({"captured", "grasps/tip-1/impulse < 4"});
  const Json& sensitivity = a.json["sensitivity"];
  ASSERT_EQ(sensitivity["groups"].size(), 2u) << sensitivity["groups"];
  EXPECT_EQ(sensitivity["groups"][0]["name"], "targets.box.grasp_points.grip");
  EXPECT_EQ(sensitivity["groups"][0]["inputs"].size(), 6u);
  EXPECT_EQ(sensitivity["groups"][1]["name"], "targets.box.mass");
  const auto measure = [&](const std::string& name) -> const Json& {
    for (const Json& one : sensitivity["measures"])
      if (one["name"] == name) return one;
    ADD_FAILURE() << name;
    return sensitivity;
  };
  // The position tolerance used depends on three coordinates together; each alone explains little.
  const Json& used = measure("grasps/tip-1/tolerance_used/position");
  for (int i = 0; i < 6; ++i) EXPECT_LT(used["first_order"][i].get<double>(), 0.45);
  EXPECT_GT(used["groups"]["first_order"][0].get<double>(), 0.85);  // measured 0.93
  EXPECT_LT(used["unexplained"].get<double>(), 0.15);
  EXPECT_GT(measure("grasps/tip-1/tolerance_used/velocity")["groups"]["first_order"][1].get<double>(), 0.9);
  EXPECT_EQ(measure("captured")["of"], "criterion");
  EXPECT_TRUE(measure("success")["unexplained"].is_number());
  EXPECT_GT(measure("success")["unexplained"].get<double>(), 0.1) << "a product of two windows";
}

TEST(CampaignReport, RoundingIsNoResult) {
  const Analyzed a = Grasping().with({"captured", "abs(noise) < 1"});
  for (const Json& measure : a.json["sensitivity"]["measures"]) EXPECT_NE(measure["name"], "noise");
  EXPECT_EQ(a.json["sensitivity"]["rounding"], Json::parse(R"(["noise"])"));
  EXPECT_EQ(campaign_summary(a.campaign, a.report).find("noise [N s]"), std::string::npos);
}

TEST(CampaignReport, FindsTheWorstCases) {
  const Json& worst = sample().json["worst"];
  ASSERT_EQ(worst.size(), 1u) << "inputs are not searched";
  EXPECT_EQ(worst[0]["by"], "a");
  EXPECT_EQ(worst[0]["direction"], "largest");
  ASSERT_EQ(worst[0]["cases"].size(), 4u);
  std::uint64_t at = 0;
  for (const CaseRow& row : sample().rows)
    if (row.values[0] > sample().rows[at].values[0]) at = row.index;
  EXPECT_EQ(worst[0]["cases"][0]["index"], at);
  EXPECT_EQ(worst[0]["cases"][0]["value"], sample().rows[at].values[0]);
  EXPECT_EQ(worst[0]["cases"][0]["inputs"][1], sample().rows[at].inputs[1]);
  EXPECT_EQ(worst[0]["cases"][0]["success"], false);
  EXPECT_EQ(worst[0]["cases"][0]["replay"], "grapnel campaign 'it'\\''s.yaml' --only " + std::to_string(at));
  EXPECT_GE(worst[0]["cases"][0]["value"], worst[0]["cases"][1]["value"]);
}

TEST(CampaignReport, GroupsReasons) {
  const Json& reasons = sample().json["reasons"];
  ASSERT_EQ(reasons.size(), 2u);
  EXPECT_EQ(reasons[0]["status"], "failed");
  EXPECT_EQ(reasons[0]["reason"], "arm-2 stops at t = … s");
  EXPECT_EQ(reasons[0]["count"], 60);
  ASSERT_EQ(reasons[0]["examples"].size(), 3u);
  EXPECT_EQ(reasons[0]["examples"][0]["index"], 17);
  EXPECT_EQ(reasons[0]["examples"][0]["reason"], sample().rows[17].reason);
  EXPECT_EQ(reasons[1]["count"], 6);
  EXPECT_EQ(sample().json["reasons_left_out"], 0);
}

TEST(CampaignReport, ReasonsOfOneKindAreTheSame) {
  EXPECT_EQ(without_numbers("t = 1.5e-3 s, |v| = -0.25 m/s"), "t = … s, |v| = … m/s");
  EXPECT_EQ(without_numbers("tip-1 of arm2 at joint-12"), "tip-1 of arm2 at joint-12");
  EXPECT_EQ(without_numbers("(3) 'x1' [0.5, -2]"), "(…) 'x1' […, …]");
  EXPECT_EQ(without_numbers("took 10s"), "took …s");
  EXPECT_EQ(without_numbers("1e5 2e 3."), "… …e ….");
  EXPECT_EQ(without_numbers("for 'Zähler 5'"), "for 'Zähler …'");
  EXPECT_EQ(without_numbers(""), "");
}

TEST(CampaignReport, CountsReasonsBeyondTheList) {
  std::vector<CaseRow> rows = sample_rows();
  for (CaseRow& row : rows)
    if (row.status == CaseStatus::failed) row.reason = "arm-" + std::to_string(row.index) + " stops";
  const Json json = analyzed(sample_campaign(), rows).json;
  EXPECT_EQ(json["reasons"].size(), 50u);
  EXPECT_EQ(json["reasons_left_out"], 60 + 1 - 50);
}

TEST(CampaignReport, IsTheSameForTheSameRows) {
  EXPECT_EQ(analyzed(sample_campaign(), sample_rows()).text, sample().text);
}

TEST(CampaignReport, OfFewOrNoRows) {
  for (const std::size_t count : {0, 1, 2, 5}) {
    std::vector<CaseRow> rows = sample_rows();
    rows.resize(count);
    const Analyzed result = analyzed(sample_campaign(), rows);
    EXPECT_EQ(result.json["rows"], count);
    EXPECT_EQ(result.json["columns"].size(), 3u);
    EXPECT_NE(campaign_summary(result.campaign, result.report).find("not done"), std::string::npos);
  }
  std::vector<CaseRow> rows = sample_rows();
  for (CaseRow& row : rows) {
    row.status = CaseStatus::failed;
    row.values.assign(3, NAN);
  }
  const Analyzed failed = analyzed(sample_campaign(), rows);
  EXPECT_EQ(failed.json["success"]["estimate"], 0.0);
  EXPECT_TRUE(failed.json["columns"][0]["mean"].is_null());
  EXPECT_TRUE(failed.json["worst"][0]["cases"].empty());
  EXPECT_EQ(failed.json["sensitivity"]["measures"].size(), 1u);
  EXPECT_TRUE(failed.json["sensitivity"]["measures"][0]["unexplained"].is_number());
  EXPECT_TRUE(failed.json["sensitivity"]["measures"][0]["first_order"][0].is_null());
}

TEST(CampaignReport, RefusesAnotherCampaignsTable) {
  const TemporaryFolder folder;
  write_campaign_tables(folder.path(), fake_campaign(1), "1", false, [](const TakeRow&) {});
  const CampaignTable table(folder.path() / "table.h5");
  Campaign other = fake_campaign(1);
  other.columns.pop_back();
  EXPECT_THROW(analyze_campaign(other, table, "1"), std::runtime_error);
}

TEST(CampaignSummary, ShowsTheMainNumbersFirst) {
  const std::string text = campaign_summary(sample().campaign, sample().report);
  for (const char* part :
       {"fake: 6000 cases, 5934 ok, 60 failed, 6 unreachable\n", "(95 % interval", "soft ", "b/x and abs(spin/x) < 2 ",
        "median", "a [N s]", "  a: mass 8", "--only", "60 × failed: arm-2 stops at t = … s (case 17)"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("b/y"), std::string::npos) << "a column that is always the same says nothing";
}

}  // namespace report_test
}  // namespace grapnel
