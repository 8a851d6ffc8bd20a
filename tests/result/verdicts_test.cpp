/// The answers of a result, as summary.json and reports show them.

#include "grapnel/result/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "result/sample_result.hpp"

namespace grapnel {
namespace verdicts_test {

using testing::HasSubstr;

Answer capture(const CaptureResult& result) { return answers_of(result)[0]; }
Answer ledger(const CaptureResult& result) { return answers_of(result)[1]; }
Answer feasibility(const CaptureResult& result) { return answers_of(result)[2]; }
Answer control(const CaptureResult& result) { return answers_of(result)[3]; }

CaptureResult captured() {
  CaptureResult result;
  result.status = CaptureStatus::completed;
  result.capture_time = 20;
  GraspOutcome grasp;
  grasp.end_effector = "tip", grasp.target = "debris", grasp.grasp_point = "handle";
  grasp.captured = true, grasp.judged = true, grasp.distance = 0.106, grasp.reason = "within the envelope";
  result.grasps = {grasp};
  return result;
}

TEST(Verdicts, CaptureHasThreeAnswers) {
  CaptureResult result = captured();
  EXPECT_EQ(capture(result).tone, Tone::good);
  EXPECT_EQ(capture(result).sentence, "1 of 1 grasps, t = 20 s, gap 106 mm.");
  result.grasps[0].judged = false, result.grasps[0].target_moved = 0.106;
  EXPECT_EQ(capture(result).word, "Assumed, no envelope");
  EXPECT_EQ(capture(result).tone, Tone::warn);
  EXPECT_EQ(capture(result).sentence,
            "1 of 1 grasps, t = 20 s, gap 106 mm, by moving debris 106 mm: no capture envelope is given for tip.");
  result.grasps[0].released = 31;
  ASSERT_EQ(capture(result).remarks.size(), 1U);
  EXPECT_EQ(capture(result).remarks[0].of, "tip -> debris/handle");
  EXPECT_EQ(capture(result).remarks[0].text, "within the envelope; release at t = 31 s");
  result.grasps[0].captured = false;
  EXPECT_EQ(capture(result).tone, Tone::bad);
  result.grasps.clear();
  EXPECT_EQ(capture(result).word, "Nothing to grasp");
}

// A capture before the first overlap remains valid.
TEST(Verdicts, CaptureBeyondValidityIsDoubtful) {
  CaptureResult result = captured();
  result.valid_until = 25;
  EXPECT_EQ(capture(result).tone, Tone::good);
  result.valid_until = 12;
  EXPECT_EQ(capture(result).tone, Tone::warn);
  EXPECT_THAT(capture(result).sentence, HasSubstr("; beyond validity, bodies overlap from t = 12 s on"));
}

TEST(Verdicts, ContactsAreNotMeantToHold) {
  CaptureResult result = captured();
  result.grasps[0].captured = false;
  result.impacts.emplace_back().grasps.resize(1);
  result.impacts[0].grasps[0].end_effector = "tip", result.impacts[0].grasps[0].model = "contact";
  EXPECT_EQ(capture(result).word, "Contact, no grasp");
  EXPECT_EQ(capture(result).remarks[0].tone, Tone::none);
}

TEST(Verdicts, FailedRunReportsItsReason) {
  CaptureResult result = captured();
  result.status = CaptureStatus::failed, result.failure = "planning: no configuration is found";
  EXPECT_EQ(capture(result).tone, Tone::bad);
  EXPECT_EQ(capture(result).sentence, "Planning: no configuration is found.");
  EXPECT_EQ(capture(result).remarks.size(), 1U);
  EXPECT_EQ(control(result).sentence, "The run ended before loads and control were evaluated.");
  result.status = CaptureStatus::completed;
  EXPECT_EQ(control(result).sentence, "No ratings and no feedback control.");
}

TEST(Verdicts, LedgerNamesFailedChecksOrTheClosest) {
  CaptureResult result = captured();
  EXPECT_EQ(ledger(result).word, "No ledger");
  result.ledger.entries = {{"energy_drift", 2e-11, 1e-10, "1", ""}, {"loop_closure_position", 1e-15, 1e-12, "m", ""}};
  EXPECT_EQ(ledger(result).tone, Tone::good);
  EXPECT_EQ(ledger(result).remarks[0].text, "energy_drift, 2e-11 of 1e-10");
  result.ledger.entries[1].value = 2e-12, result.ledger.entries[1].advice = "reduce the step size";
  EXPECT_EQ(ledger(result).tone, Tone::bad);
  EXPECT_EQ(ledger(result).sentence,
            "FAILS, 1 of 2 conserved quantities outside their bounds: the result is not valid.");
  EXPECT_EQ(ledger(result).remarks[0].text, "loop_closure_position is 2e-12 m, bound 1e-12 m; reduce the step size");
}

TEST(Verdicts, UncheckedRunsAreNeitherFeasibleNorInfeasible) {
  CaptureResult result = test::sample_result();
  EXPECT_EQ(feasibility(result).tone, Tone::bad);
  EXPECT_THAT(feasibility(result).sentence, testing::StartsWith("Valid until 32 s, where bodies overlap; first rate"));
  ASSERT_EQ(feasibility(result).remarks.size(), 2U);
  EXPECT_EQ(feasibility(result).remarks[1].of, "worst in post_impact");
  LedgerEntry& clearance = result.ledger.entries.back();
  clearance.value = 0;
  EXPECT_EQ(feasibility(result).tone, Tone::good);
  EXPECT_EQ(feasibility(result).sentence, "Clearance is kept.");
  clearance.applies = false, clearance.not_checked = "switched off by clearance.enabled";
  EXPECT_EQ(feasibility(result).word, "Not checked");
  EXPECT_EQ(feasibility(result).tone, Tone::none);
  EXPECT_EQ(feasibility(result).sentence, "Clearance: switched off by clearance.enabled.");
}

TEST(Verdicts, NegativeFindingsAreReportedFirst) {
  CaptureResult result = captured();
  EXPECT_EQ(control(result).word, "Not evaluated");
  EXPECT_EQ(control(result).tone, Tone::none);
  result.peak_loads = {{"elbow", "force", "contact", 80, 20, 100, false}};
  EXPECT_EQ(control(result).word, "Ratings kept");
  EXPECT_EQ(control(result).tone, Tone::good);
  result.stability.resize(1);
  result.stability[0].phase = "post_impact", result.stability[0].verdict = Stability::not_evaluated;
  EXPECT_EQ(control(result).word, "Ratings kept");
  EXPECT_EQ(control(result).tone, Tone::none) << "a verdict never says more than was checked";
  result.stability[0].verdict = Stability::stable;
  EXPECT_EQ(control(result).word, "Stable");
  result.saturation = {
      {SaturationReport::Actuator::wheel, "a", SaturationReport::Quantity::rate, 418.88, 10, 52, 0.44, true}};
  EXPECT_EQ(control(result).word, "Saturated");
  EXPECT_EQ(control(result).tone, Tone::warn);
  result.peak_loads[0].peak = 313.7;
  EXPECT_EQ(control(result).word, "Ratings exceeded");
  EXPECT_EQ(control(result).sentence, "Ratings: EXCEEDED, 1 of 1: elbow (force).");
  result.stability[0].verdict = Stability::unstable, result.stability[0].of = "base x";
  EXPECT_EQ(control(result).word, "Unstable");
  EXPECT_EQ(control(result).remarks.size(), 2U);
}

TEST(Verdicts, RestIsTheGoalOfScenariosThatStateItsRates) {
  CaptureResult result = captured();
  EXPECT_EQ(answers_of(result).size(), 4U);
  RestReport& rest = result.rest.emplace();
  rest.at_rest = true, rest.time = 31, rest.angular_velocity = 0.001, rest.angular_velocity_limit = 0.01;
  ASSERT_EQ(answers_of(result).size(), 5U);
  Answer goal = answers_of(result).back();
  EXPECT_EQ(goal.question, "Goal");
  EXPECT_EQ(goal.word, "At rest");
  EXPECT_EQ(goal.tone, Tone::good);
  EXPECT_EQ(goal.sentence, "At rest: yes, from t = 31 s on; at the end base at 0.001 of 0.01 rad/s.");
  rest.at_rest = false;
  goal = answers_of(result).back();
  EXPECT_EQ(goal.word, "Not at rest");
  EXPECT_EQ(goal.tone, Tone::bad);
}

TEST(Verdicts, WindowNamesTheSelectedTime) {
  WindowReport window;
  EXPECT_EQ(window_sentence(window), "");
  window.points.resize(3);
  window.points[0].time = 30, window.points[1].time = 90, window.points[2].time = 150;
  window.points[1].reachable = true;
  window.time = 90;
  EXPECT_EQ(window_sentence(window), "capture at t = 90 s, selected from 3 times between 30 and 150 s; 1 reachable");
  window.time = NAN, window.not_before = 200;
  EXPECT_EQ(window_sentence(window),
            "none of 3 times between 30 and 150 s is reachable; by distance alone, none before t = 200 s");
}

}  // namespace verdicts_test
}  // namespace grapnel
