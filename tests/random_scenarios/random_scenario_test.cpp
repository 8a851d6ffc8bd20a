// Random valid scenarios from the file to the ledger.
//
//   RC_PARAMS="seed=42 max_success=1000"   RapidCheck's own parameters, if given
//   GRAPNEL_TEST_SEED=42                   else the seed
//
// A failing case is shrunk for at most a minute and printed as a scenario file, to be saved and given to `grapnel run`.

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>
#include <set>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/summary.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "random_scenarios/scenario_text.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace {

// Before RapidCheck first looks: its own default is another seed each time.
void set_parameters() {
  const char* seed = getenv("GRAPNEL_TEST_SEED");
  const std::string parameters =
      std::string("seed=") + (seed != nullptr ? seed : "20240711") + " max_success=" GRAPNEL_RANDOM_CASES;
  setenv("RC_PARAMS", parameters.c_str(), 0);
  std::printf("RC_PARAMS=\"%s\"\n", getenv("RC_PARAMS"));
}

// What happened in all cases together: a generator that makes only failures, or nothing that moves, tests nothing.
struct Tally {
  int runs = 0, completed = 0, impacts = 0, motions_after = 0, brakes = 0, shared = 0;
  int mended = 0;      // ledgers that needed a smaller tolerance
  int wild = 0;        // see is_wild()
  double slowest = 0;  // [s]
  std::vector<std::string> failures;
};
Tally tally;

bool grip_one_target(const ImpactReport& impact) {
  std::set<std::string> targets;
  for (const GraspImpulse& grasp : impact.grasps) targets.insert(grasp.target);
  return targets.size() < impact.grasps.size();
}

void note(const CaptureResult& result, double seconds) {
  ++tally.runs;
  tally.completed += result.status == CaptureStatus::completed;
  tally.impacts += result.impact.has_value();
  tally.motions_after += result.post_impact_end.has_value();
  tally.brakes += result.impact && result.impact->brake.has_value();
  tally.shared += result.impact && grip_one_target(*result.impact);
  tally.slowest = std::max(tally.slowest, seconds);
  if (!result.failure.empty()) tally.failures.push_back(result.failure);
}

void expect_finite(const CaptureResult& result) {
  for (const Series& series : result.series.series) {
    if (series.path.starts_with("joints/reference_")) continue;  // NaN where joints follow nothing
    for (const double value : series.data) {
      if (!std::isfinite(value)) RC_FAIL("not finite: series " + series.path);
    }
  }
  // Whatever is not finite becomes null in the summary.
  const std::string summary = summary_json(result, "test");
  const std::size_t at = summary.find(": null");
  if (at != std::string::npos) RC_FAIL("not finite: summary " + summary.substr(summary.rfind('\n', at), 80));
}

void expect_same(const CaptureResult& a, const CaptureResult& b) {
  RC_ASSERT(summary_json(a, "test") == summary_json(b, "test"));
  RC_ASSERT(a.series.series.size() == b.series.series.size());
  for (std::size_t i = 0; i < a.series.series.size(); ++i) {
    const auto &x = a.series.series[i].data, &y = b.series.series[i].data;
    RC_ASSERT(x.size() == y.size());
    if (!x.empty() && std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) != 0) {
      RC_FAIL("another run gives other bits: series " + a.series.series[i].path);
    }
  }
}

// Matched rates near a singularity may be those of no machine, 16,000 rad/s say; rounding alone then breaks bounds.
bool is_wild(const CaptureResult& result) {
  if (!result.approach_end) return false;
  const auto& rates = result.approach_end->joints.velocity;
  return std::any_of(rates.begin(), rates.end(), [](double rate) { return std::abs(rate) > 100; });
}

// The ledger holds, or does with the smallest tolerances, as the program says when it fails: what is wrong in the
// mechanics stays wrong with any tolerance.
void expect_ledger(CaptureProblem problem, const CaptureResult& result) {
  if (result.ledger.pass()) return;
  if (is_wild(result)) {
    ++tally.wild;
    return;
  }
  ++tally.mended;
  problem.integration.max_steps = 10'000'000;
  problem.integration.relative_tolerance = 2e-14;
  problem.integration.absolute_tolerance = 1e-18;
  const CaptureResult again = simulate_capture(problem);
  RC_ASSERT(again.status == CaptureStatus::completed);
  for (const LedgerEntry& entry : again.ledger.entries) {
    if (entry.pass() || entry.kind != LedgerEntry::Kind::conservation) continue;
    RC_FAIL("ledger: " + entry.name + " is " + std::to_string(entry.value / entry.bound) + " bounds at the tightest");
  }
}

void check(const std::filesystem::path& file) {
  CaptureProblem problem;
  try {
    problem = load_scenario(file);
  } catch (const ScenarioError& error) {
    RC_FAIL(std::string("a valid scenario is refused: ") + error.what());
  }
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult result = simulate_capture(problem);
  note(result, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());

  if (result.status == CaptureStatus::completed) {
    RC_ASSERT(result.failure == "");
    // Fixed steps have no tolerance, so nobody can say what they keep.
    if (problem.integration.method == IntegrationSetup::Method::adaptive_8) expect_ledger(problem, result);
  } else {
    RC_ASSERT(result.status == CaptureStatus::failed);
    RC_ASSERT(result.failure.size() > 10u);
  }
  expect_finite(result);
  expect_same(result, simulate_capture(problem));
}

TEST(RandomScenarios, RunAndKeepTheirLedger) {
  set_parameters();
  const grapnel::test::TemporaryFolder folder;
  using Clock = std::chrono::steady_clock;
  std::optional<Clock::time_point> first_failure;
  std::string failing;
  const bool passed = rc::check("a valid scenario runs, keeps its ledger, and runs again to the same bits", [&] {
    const ScenarioText scenario = *scenario_text();
    // Enough of shrinking: nothing fails any more, but what failed last still does.
    const bool enough = first_failure && Clock::now() - *first_failure > std::chrono::minutes(1);
    if (enough && scenario.yaml != failing) return;
    try {
      check(folder.write("random.yaml", scenario.yaml));
    } catch (...) {
      if (!first_failure) first_failure = Clock::now();
      failing = scenario.yaml;
      throw;
    }
  });
  EXPECT_TRUE(passed);
  std::printf(
      "[ measured ] %d runs: %d completed, %d with impact, %d braked, %d on one target, %d moved on; ledgers: %d "
      "needed smaller tolerances, %d failed at wild rates; slowest %.3f s\n",
      tally.runs, tally.completed, tally.impacts, tally.brakes, tally.shared, tally.motions_after, tally.mended,
      tally.wild, tally.slowest);
  if (!passed) return;
  for (const std::string& failure : tally.failures) std::printf("[ measured ] stopped: %s\n", failure.c_str());
  EXPECT_GE(10 * tally.completed, 8 * tally.runs);
  EXPECT_LE(20 * (tally.mended + tally.wild), tally.runs);
  EXPECT_GE(2 * tally.impacts, tally.runs);
  EXPECT_GE(4 * tally.motions_after, tally.runs);
}

}  // namespace
}  // namespace grapnel::testing
