#include "grapnel/result/result_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace result_table_test {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::size_t widest(const std::string& text) {
  std::istringstream lines(text);
  std::size_t width = 0;
  for (std::string line; std::getline(lines, line);) width = std::max(width, text_width(line));
  return width;
}

TEST(ResultTable, ShowsTheVerdictsFirst) {
  CaptureResult result = test::sample_result();
  GraspImpulse& left = result.impacts[0].grasps[0];
  left.impulse_magnitude = 12.345678;
  left.mean_force = 123.45678;
  result.impacts[0].as_published->grasps[0].impulse_magnitude = 98.7654321;
  result.impacts[0].kinetic_energy_before = 5.25;
  result.impacts[0].kinetic_energy_after = 4.125;
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("sample: completed"));
  EXPECT_THAT(text, HasSubstr("ledger: FAILS, 1 of 2 conserved quantities outside their bounds"));
  EXPECT_THAT(text, HasSubstr("captured: NO (1 of 2 grasps, t = 20 s, largest gap "));
  EXPECT_THAT(text, HasSubstr("right -> debris/rail: outside the envelope"));
  // The first violation leads, then the worst of each phase.
  EXPECT_THAT(text, HasSubstr("feasible: NO, valid until 32 s, where bodies overlap; first rate of left-1 passes its "
                              "limit -0.2 at\nt = 3 s (approach)\n"
                              "  worst in approach: rate of left-1 is -0.3, its limit -0.2 at t = 3.5 s\n"
                              "  worst in post_impact: base and debris overlap by 0.05 m at t = 33 s\n"));
  EXPECT_THAT(text, HasSubstr("after the impact, at its end (t = 70 s; beyond validity, which ends at t = 32 s)"));
  EXPECT_THAT(text, HasSubstr("plan: found, 4 of 5 initial guesses, 23 Newton steps, objective excursion"));
  EXPECT_THAT(text, HasSubstr("warning: second"));
  EXPECT_THAT(text, ContainsRegex("left -> debris/left_handle [*] +12\\.346 +98\\.765 .* 123\\.46"));
  EXPECT_THAT(text, HasSubstr("5.25 -> 4.125"));
  EXPECT_THAT(text, HasSubstr("rank 11 of 12 rows"));
  EXPECT_THAT(text, ContainsRegex("linear_momentum_drift +3\\.25e-15 +1e-11 +1 +yes"));
  EXPECT_THAT(text, ContainsRegex("angular_momentum_drift +2e-11 +1e-11 +1 +NO"));
  EXPECT_THAT(text, Not(HasSubstr("loop_closure_position"))) << "nothing to check";
  EXPECT_THAT(text, Not(HasSubstr("\033")));
}

// captured: yes, no or assumed, with the gap; feasible: yes, no or not checked, with the reason.
TEST(ResultTable, ReportsOnlyEvaluatedChecks) {
  CaptureResult result = test::sample_result();
  result.grasps[1].captured = true;
  result.grasps[0].distance = 0.004, result.grasps[1].distance = 0.0066;
  EXPECT_THAT(result_table(result), HasSubstr("\ncaptured: yes (2 of 2 grasps, t = 20 s, largest gap 6.6 mm)\n"));
  for (GraspOutcome& grasp : result.grasps) grasp.judged = false, grasp.distance = 38.2;
  EXPECT_THAT(result_table(result), HasSubstr("\ncaptured: assumed (2 of 2 grasps, t = 20 s, largest gap 38.2 m): no "
                                              "capture envelope is given for\nleft and right\n"));
  for (GraspOutcome& grasp : result.grasps) grasp.target_moved = 0.106;
  EXPECT_THAT(result_table(result), HasSubstr("\ncaptured: assumed, by moving debris 106 mm (2 of 2 grasps"));
  result.valid_until = 12;
  EXPECT_THAT(capture_sentence(result), HasSubstr("; beyond validity, bodies overlap from t = 12 s on"));

  LedgerEntry& clearance = result.ledger.entries.back();
  clearance.value = 0;
  result.clearance_events.clear(), result.limit_events.clear();
  result.first_violation.reset(), result.valid_until.reset();
  EXPECT_THAT(result_table(result), HasSubstr("\nfeasible: yes, clearance is kept\n"));
  clearance.not_checked = "no shape is stated for left_link";
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("\nfeasible: not checked; clearance: no shape is stated for left_link\n"));
  EXPECT_THAT(text, ContainsRegex("clearance_violation +0 +0 +m +not checked"));
  clearance.applies = false, clearance.not_checked = "switched off by clearance.enabled";
  EXPECT_THAT(result_table(result), ContainsRegex("clearance_violation +- +0 +m +not checked"));
}

TEST(ResultTable, ShowsThesisFormulasOnlyOnRequest) {
  CaptureResult result = test::sample_result();
  result.impacts[0].as_published->grasps[0].impulse_magnitude = 98.7654321;
  result.impacts[0].show_as_published = true;
  EXPECT_THAT(result_table(result), HasSubstr("as publ."));
  EXPECT_THAT(result_table(result), HasSubstr("98.765"));
  EXPECT_THAT(result_table(result), HasSubstr("as published, (3.8)-(3.13), violates momentum conservation"));
  for (ImpactReport& impact : result.impacts) impact.show_as_published = false;
  EXPECT_THAT(result_table(result), Not(HasSubstr("publ")));
  EXPECT_THAT(result_table(result), Not(HasSubstr("98.765")));
}

TEST(ResultTable, ShowsLoopsLaterImpactsReleasesAndLoads) {
  CaptureResult result = test::sample_result();
  result.loops[0].unprojected_position = 1.25e-13;
  result.loops[0].unprojected_angle = 2.5e-13;
  result.loops[0].correction_total = 3.75e-12;
  result.grasp_loads[1].largest_force = 12.345678;
  result.grasp_loads[1].force_time = 21.5;
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("\nimpact at t = 20 s: plastic, rank 11 of 12 rows, impulses not unique, mean"));
  EXPECT_THAT(text, HasSubstr("\nlater impact at t = 27 s: plastic, rank 12 of 12 rows, mean force over 0.1 s\n"));
  EXPECT_THAT(text,
              HasSubstr("  the loop over debris has a gap of 0.25 m: left and right are 1.25 m apart, left_handle "
                        "and\n  right_handle 1 m\n"));
  EXPECT_THAT(text,
              HasSubstr("\nloss at t = 44 s: third loses debris, under 12.5 N and 2.5 N m (1.25 of its limits)\n"));
  EXPECT_THAT(text, HasSubstr("\nrelease at t = 45 s: left releases debris, right releases debris\n"));
  EXPECT_THAT(text, HasSubstr("\nclosed loops, post_impact: right - debris, third - debris; rank 9 of 12 rows\n"));
  EXPECT_THAT(text, ContainsRegex("largest defect of a step +m, rad +1\\.25e-13 +2\\.5e-13\n"));
  EXPECT_THAT(text, ContainsRegex("corrections, integration errors +1 +3\\.75e-12"));
  EXPECT_THAT(text, ContainsRegex("\n  left -> debris +post_impact"));
  EXPECT_THAT(text, ContainsRegex("\n  right -> debris [*] +post_impact +12\\.346 +21\\.5"));
  EXPECT_THAT(text, ContainsRegex("the minimum is\\s+reported"));

  // A loop that closes within tolerance has no line; without a null space there is no mark.
  result.impacts[0].loops[0].end_effector_distance = 1 + 9e-7;
  result.impacts.resize(1);
  result.grasp_loads.pop_back();
  const std::string shorter = result_table(result);
  EXPECT_THAT(shorter, Not(HasSubstr("the loop over")));
  EXPECT_THAT(shorter, Not(ContainsRegex("the minimum is\\s+reported")));
  result.impacts[0].loops[0].end_effector_distance = 1 + 1.1e-6;
  EXPECT_THAT(result_table(result), HasSubstr("has a gap of 1.1e-06 m"));
}

TEST(ResultTable, StaysWithinItsColumns) {
  CaptureResult result = test::sample_result();
  const std::string name(90, 'n');
  result.warnings = {"a long warning that continues " + std::string("and on ") +
                     "with many words, more than a line of a "
                     "terminal holds, so that it has to be broken somewhere between them"};
  for (GraspImpulse& grasp : result.impacts[0].grasps) {
    grasp.target = name;
    grasp.impulse_magnitude = -1.23456789e-100;
    grasp.mean_force = -1.23456789e-100;
    grasp.gap = std::numeric_limits<double>::quiet_NaN();
  }
  for (EndEffectorMotion& e : result.approach_end->end_effectors) e.target = name;
  result.impacts[0].base_velocity_change = {-1.23456789e-100, -1.23456789e-100, -1.23456789e-100};
  result.ledger.entries[0].name = name;
  result.impacts[0].loops[0].target = name;
  result.releases[0].targets[0] = name;
  result.loops[0].closures[0] = name;
  result.loops[0].correction_total = -1.23456789e-100;
  for (GraspLoad& load : result.grasp_loads) {
    load.target = name;
    load.phase = "post_impact";
    load.largest_force = load.force_time = load.largest_moment = load.moment_time = -1.23456789e-100;
  }
  const std::string text = result_table(result);
  EXPECT_LE(widest(text), 100u) << text;
  EXPECT_THAT(text, HasSubstr("…"));
  EXPECT_THAT(text, HasSubstr("nan"));
}

TEST(ResultTable, OmitsAbsentPhases) {
  CaptureResult result;
  result.scenario_name = "nothing";
  EXPECT_EQ(result_table(result), "nothing: not run\nledger: empty\n");
  result = test::sample_result();
  result.status = CaptureStatus::failed;
  result.failure = "body arm_2 at 3.5 s: not a number";
  result.impacts.clear();
  result.releases.clear();
  result.loops.clear();
  result.grasp_loads.clear();
  result.post_impact_end.reset();
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("sample: FAILED: body arm_2 at 3.5 s: not a number\n"));
  EXPECT_THAT(text, Not(HasSubstr("impact at")));
  for (const char* words : {"release at", "closed loops", "load on a grasp"}) EXPECT_THAT(text, Not(HasSubstr(words)));
}

// All laws have one structure, and each shows and writes its own keys.
TEST(ResultTable, LawsShowTheirKeys) {
  CaptureResult result;
  LawReport keeping, squeeze;
  keeping.law = LawReport::Law::base_keeping, keeping.largest_angle = 0.25, keeping.least_share = 0.5;
  keeping.end = 75.25;
  squeeze.law = LawReport::Law::grasp_force, squeeze.target = "debris", squeeze.within_limits = false;
  squeeze.pairs = {{{"left", "right"}, 20, 20.5, 0.125, 3}};
  result.laws = {keeping, squeeze};
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("\nbase attitude controlled by the joints: still active at t = 75.25 s"));
  EXPECT_THAT(text, ContainsRegex("\n  largest angle +rad +0\\.25\n"));
  EXPECT_THAT(text, ContainsRegex("\n  minimum fraction that limits admit +0\\.5\n"));
  EXPECT_THAT(text, Not(HasSubstr("torque")));
  EXPECT_THAT(text, HasSubstr("\ngrasp forces on debris: still active"));
  EXPECT_THAT(text, ContainsRegex("\n  left, right +20 +20\\.5 +0\\.125\n"));
  EXPECT_THAT(text, HasSubstr("efforts were limited: the target deviated from its commanded motion\n"));
  EXPECT_EQ(result.law(LawReport::Law::detumbling), nullptr);
  EXPECT_EQ(result.law(LawReport::Law::grasp_force, true), nullptr);
  const auto base = json_of(keeping), forces = json_of(squeeze);
  for (const char* key : {"rank", "least_share", "angle_after"}) EXPECT_TRUE(base.contains(key)) << key;
  for (const char* key : {"target", "least_scale", "internal_rank", "pairs"}) EXPECT_FALSE(base.contains(key)) << key;
  for (const char* key : {"target", "least_scale", "internal_rank", "pairs"}) EXPECT_TRUE(forces.contains(key)) << key;
  for (const char* key : {"rank", "least_share", "torque_bound"}) EXPECT_FALSE(forces.contains(key)) << key;
}

TEST(DescribedTable, TakesHeadsUnitsAndValuesFromTheDescription) {
  WheelReport wheel;
  wheel.name = "x", wheel.rate_after = 1.25, wheel.rate_limit = std::numeric_limits<double>::infinity();
  wheel.largest_torque = std::numeric_limits<double>::quiet_NaN();
  const std::string text =
      described_table(std::vector{wheel}, "name = wheel; rate_after = after; rate_limit; largest_torque",
                      [](const WheelReport&) { return " *"; });
  EXPECT_EQ(text,
            "  wheel  after  rate limit  largest torque\n         rad/s       rad/s             N m\n"
            "  x *     1.25        none               -\n");
  EXPECT_EQ(described_table(std::vector<WheelReport>{}, "name"), "");
  EXPECT_THROW(described_table(std::vector{wheel}, "name; colour"), std::logic_error);
}

TEST(TextTable, AlignsColumnsByCharactersNotBytes) {
  TextTable table;
  table.row({"né", "1"});
  table.row({"name", "23"});
  EXPECT_EQ(table.text(), "  né     1\n  name  23\n");
}

}  // namespace result_table_test
}  // namespace grapnel
