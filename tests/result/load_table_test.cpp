/// Loads of all phases on the terminal and in summary.json.

#include "grapnel/result/load_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace load_table_test {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

// An end-effector whose impact load, for an assumed duration of 1 ms, is within its rating, and whose later load is
// not.
CaptureResult sample() {
  CaptureResult result;
  result.scenario_name = "sample";
  result.status = CaptureStatus::completed;
  result.peak_loads = {{"elbow", "driving", "approach", 40, 3.5, 40, false},
                       {"elbow", "force", "approach", 12, 1.5},
                       {"left", "impulse", "contact", 0.0284, 20},
                       {"left", "force", "contact", 28.4, 20, 400, true},
                       {"left", "force", "post_impact", 485, 21.25, 400, false}};
  result.limit_events = {{LimitKind::effort_saturated, "elbow", "approach", 3, 4.5, 40, 3.5, 40},
                         {LimitKind::rate, "elbow", "approach", 3, 4, 0.3, 3.5, 0.2},
                         {LimitKind::effort_saturated, "elbow", "approach", 6, 6.25, -40, 6.1, -40}};
  return result;
}

TEST(LoadTable, TheWorstMarginOverAllPhasesLeads) {
  const std::string text = result_table(sample());
  EXPECT_THAT(text,
              HasSubstr("worst margin: -21.2 % EXCEEDED; force of left, 485 of 400 at t = 21.25 s (post_impact)"));
  EXPECT_LT(text.find("worst margin"), text.find("ledger"));
  EXPECT_LT(text.find("worst margin"), 200U);
  const CaptureResult result = sample();
  ASSERT_TRUE(worst_margin(result));
  EXPECT_EQ(worst_margin(result)->phase, "post_impact");
}

TEST(LoadTable, MarksMarginsWithAssumedDuration) {
  CaptureResult result = sample();
  result.peak_loads[3].rating = 20;
  EXPECT_NEAR(assumed_duration(result, result.peak_loads[3]), 1e-3, 1e-15);
  const std::string line = worst_margin_line(result);
  EXPECT_THAT(
      line, HasSubstr("worst margin: -42.0 % EXCEEDED; force of left, 28.4 of 20 at t = 20 s (contact), a mean over"));
  EXPECT_THAT(line, HasSubstr("over an\nassumed 1 ms\n"));
  EXPECT_THAT(line, HasSubstr("without assumed durations: -21.2 %"));
  EXPECT_THAT(margins_table(result), HasSubstr("* a mean over an assumed 1 ms (impact.duration)"));
  result.peak_loads.resize(4);
  result.peak_loads.erase(result.peak_loads.begin());
  EXPECT_THAT(worst_margin_line(result), HasSubstr("every margin depends on that assumption"));
}

TEST(LoadTable, MarksAssumedDurationsOfImpactMargins) {
  CaptureResult result = sample();
  result.impacts.emplace_back();
  result.impacts[0].duration = 1e-3;
  result.impacts[0].margins = {{"left", "force", 28.4, 400}, {"left", "impulse", 0.0284, 1}};
  EXPECT_THAT(result_table(result), HasSubstr("a mean over an assumed 1 ms"));
  json margins = json::parse(summary_json(result, "1"))["impact"]["margins"];
  EXPECT_EQ(margins[0]["assumed_duration"], true);
  EXPECT_EQ(margins[1]["assumed_duration"], false);
  result.impacts[0].compliant.emplace();
  margins = json::parse(summary_json(result, "1"))["impact"]["margins"];
  EXPECT_EQ(margins[0]["assumed_duration"], false);
}

TEST(LoadTable, ReportsSaturation) {
  using Actuator = SaturationReport::Actuator;
  using Quantity = SaturationReport::Quantity;
  CaptureResult result = sample();
  EXPECT_EQ(saturation_sentence(result), "");
  result.saturation = {{Actuator::wheel, "a", Quantity::rate, 418.88, 2, 10, 0.5, true},
                       {Actuator::joint, "elbow", Quantity::effort, 40, 3, 1.75, 0.1, false},
                       {Actuator::base_control, "x", Quantity::torque, 16, 0, 0.01, 0.0005, false},
                       {Actuator::thruster, "t", Quantity::duty, 1, 0, 0.01, 0.0005, true}};
  EXPECT_EQ(
      saturation_sentence(result),
      "saturated: wheel a at its largest rate 418.88 rad/s for 10 s (50 % of the motion), first at t = 2 s, and at "
      "the end; 3 more, see saturation");
  EXPECT_THAT(result_table(result), HasSubstr("saturated: wheel a at its largest rate"));
  // Short saturations give no warning, except those at the end.
  EXPECT_THAT(saturation_warnings(result),
              testing::ElementsAre(HasSubstr("wheel a"),
                                   "saturated: drive of elbow at its effort limit 40 for 1.75 s (10 % of the motion), "
                                   "first at t = 3 s",
                                   HasSubstr("thruster t on continuously, delivers less than commanded")));
  const json summary = json::parse(summary_json(result, "1"));
  ASSERT_EQ(summary["saturation"].size(), 4U);
  EXPECT_EQ(summary["saturation"][0], (json{{"actuator", "wheel"},
                                            {"name", "a"},
                                            {"quantity", "rate"},
                                            {"limit", 418.88},
                                            {"first_time", 2},
                                            {"duration", 10},
                                            {"share", 0.5},
                                            {"at_end", true}}));
  EXPECT_FALSE(json::parse(summary_json(sample(), "1")).contains("saturation"));
}

TEST(LoadTable, NamesExceededRatings) {
  EXPECT_EQ(ratings_sentence(sample()), "ratings: EXCEEDED, 1 of 2: left (force)");
  EXPECT_THAT(result_table(sample()), HasSubstr("ratings: EXCEEDED, 1 of 2: left (force)"));
  CaptureResult within_ratings = sample();
  within_ratings.peak_loads.pop_back();
  EXPECT_EQ(ratings_sentence(within_ratings), "");
}

// A drive that saturates at its limit is not close to a rating.
TEST(LoadTable, ADriveAtItsLimitIsSaturated) {
  CaptureResult result = sample();
  result.peak_loads.resize(1);
  EXPECT_THAT(worst_margin_line(result), HasSubstr("worst margin: saturated; driving of elbow, 40 of 40"));
  result.peak_loads[0].peak = 39.8;
  EXPECT_THAT(worst_margin_line(result), HasSubstr("worst margin: 0.5 %;"));
}

TEST(LoadTable, IsSilentWhereNothingIsRated) {
  CaptureResult result = sample();
  for (PeakLoad& load : result.peak_loads) load.rating = std::numeric_limits<double>::infinity();
  result.limit_events.clear();
  EXPECT_EQ(worst_margin(result), nullptr);
  EXPECT_EQ(margins_table(result), "");
  EXPECT_THAT(result_table(result), Not(HasSubstr("worst")));
}

TEST(LoadTable, SummaryHasThemAll) {
  const json summary = json::parse(summary_json(sample(), "1"));
  ASSERT_EQ(summary["loads"].size(), 5U);
  const json& load = summary["loads"][4];
  EXPECT_EQ(load, summary["worst_margin"]);
  EXPECT_EQ(load["of"], "left");
  EXPECT_EQ(load["quantity"], "force");
  EXPECT_EQ(load["phase"], "post_impact");
  EXPECT_EQ(load["peak"], 485);
  EXPECT_EQ(load["time"], 21.25);
  EXPECT_EQ(load["rating"], 400);
  EXPECT_EQ(load["margin"], 1 - 485.0 / 400);
  EXPECT_EQ(load["assumed_duration"], false);
  EXPECT_TRUE(summary["loads"][1]["rating"].is_null());
  EXPECT_TRUE(summary["loads"][1]["margin"].is_null());
  EXPECT_EQ(summary["loads"][3]["assumed_duration"], true);
  EXPECT_FALSE(json::parse(summary_json({}, "1")).contains("worst_margin"));
}

}  // namespace load_table_test
}  // namespace grapnel
