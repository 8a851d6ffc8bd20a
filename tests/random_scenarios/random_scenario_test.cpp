// Random valid scenarios, from the file to the ledger. Seeds: random_run.hpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "random_scenarios/random_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace random_scenario_test {

// Totals over all cases: a generator that produces only failures, or no motion, tests nothing.
struct Tally {
  int runs = 0, completed = 0, impacts = 0, motions_after = 0, brakes = 0, shared = 0;
  int later = 0, missed = 0, released = 0, looped = 0, redundant = 0;
  int retried = 0;     // ledgers that needed a smaller tolerance
  int wild = 0;        // see is_wild()
  double slowest = 0;  // [s]
  std::vector<std::string> failures;
};
Tally tally;

bool grasp_one_target(const ImpactReport& impact) {
  std::set<std::string> targets;
  for (const GraspImpulse& grasp : impact.grasps) targets.insert(grasp.target);
  return targets.size() < impact.grasps.size();
}

void note(const CaptureResult& result, double seconds) {
  ++tally.runs;
  tally.completed += result.status == CaptureStatus::completed;
  tally.impacts += result.impact() != nullptr;
  tally.motions_after += result.post_impact_end.has_value();
  tally.brakes += result.impact() && result.impact()->brake.has_value();
  tally.shared += result.impact() && grasp_one_target(*result.impact());
  tally.later += !result.later_impacts().empty();
  tally.missed += !result.grasps.empty() && !result.captured();
  tally.released += !result.releases.empty();
  tally.looped += !result.loops.empty();
  for (const LoopReport& loops : result.loops) tally.redundant += loops.rank < loops.rows;
  tally.slowest = std::max(tally.slowest, seconds);
  if (!result.failure.empty()) tally.failures.push_back(result.failure);
}

// Near a singularity, matched rates may be unrealistic, e.g. 16,000 rad/s; rounding errors alone then exceed bounds.
bool is_wild(const CaptureResult& result) {
  if (!result.approach_end) return false;
  const auto& rates = result.approach_end->joints.velocity;
  return std::any_of(rates.begin(), rates.end(), [](double rate) { return std::abs(rate) > 100; });
}

// The ledger passes, if necessary with the smallest tolerances, as advised by the program: errors in the mechanics
// persist at any tolerance.
void expect_ledger(CaptureProblem problem, const CaptureResult& result) {
  if (result.ledger.pass()) return;
  if (is_wild(result)) {
    ++tally.wild;
    return;
  }
  ++tally.retried;
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
  } catch (const InputError& error) {
    RC_FAIL(std::string("a valid scenario is refused: ") + error.what());
  }
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult result = simulate_capture(problem);
  note(result, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());

  if (result.status == CaptureStatus::completed) {
    RC_ASSERT(result.failure == "");
    // Fixed steps have no tolerance and therefore no bound. The same applies to the comparison modes for loops.
    const IntegrationSetup& how = problem.integration;
    if (how.method != IntegrationSetup::Method::rk4 && how.loops == IntegrationSetup::Loops::projection) {
      expect_ledger(problem, result);
    }
  } else {
    RC_ASSERT(result.status == CaptureStatus::failed);
    RC_ASSERT(result.failure.size() > 10u);
  }
  require_finite(result);
  if (!grapnel::test::kSanitized) require_same(result, simulate_capture(problem));
}

TEST(RandomScenarios, RunAndLedgerPasses) {
  const bool passed = passes_on_random("a valid scenario runs, keeps its ledger, and runs again to the same bits",
                                       scenario_text(), GRAPNEL_RANDOM_SCENARIOS, check);
  EXPECT_TRUE(passed);
  std::printf(
      "[ measured ] %d runs: %d completed, %d with impact, %d braked, %d on one target, %d moved on; %d with later "
      "impacts, "
      "%d missed, %d release, %d phases of %d looped with redundant closures; ledgers: %d "
      "needed smaller tolerances, %d failed at wild rates; slowest %.3f s\n",
      tally.runs, tally.completed, tally.impacts, tally.brakes, tally.shared, tally.motions_after, tally.later,
      tally.missed, tally.released, tally.redundant, tally.looped, tally.retried, tally.wild, tally.slowest);
  if (!passed) return;
  for (const std::string& failure : tally.failures) std::printf("[ measured ] stopped: %s\n", failure.c_str());
  EXPECT_GE(10 * tally.completed, 8 * tally.runs);
  EXPECT_LE(20 * (tally.retried + tally.wild), tally.runs);
  EXPECT_GE(2 * tally.impacts, tally.runs);
  EXPECT_GE(4 * tally.motions_after, tally.runs);
}

}  // namespace random_scenario_test
}  // namespace grapnel::testing
