// Random scenarios with contacts between shapes, from the file to the ledger. Seeds: random_run.hpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "random_scenarios/contact_text.hpp"
#include "random_scenarios/random_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace random_contact_test {

// Totals over all cases: a generator whose bodies never touch tests nothing.
struct Tally {
  int runs = 0, overlaps = 0, completed = 0, touching = 0, impacts = 0, captured = 0, lost = 0;
  double slowest = 0;  // [s]
  std::vector<std::string> failures;
};
Tally tally;

void note(const CaptureResult& result) {
  ++tally.completed;
  tally.touching += std::ranges::any_of(result.contacts, [](const auto& pair) { return pair.touches > 0; });
  tally.impacts +=
      std::ranges::any_of(result.contacts, [](const auto& pair) { return pair.hard && pair.hard->impacts > 0; });
  tally.captured += !result.grasps.empty() && result.captured();
  tally.lost += !result.losses.empty();
}

void check(const std::filesystem::path& file) {
  const CaptureProblem problem = load_scenario(file);
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult result = simulate_capture(problem);
  tally.slowest =
      std::max(tally.slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  ++tally.runs;
  require_finite(result);
  if (result.status != CaptureStatus::completed) {
    RC_ASSERT(result.failure.size() > 10u);
    const bool overlap = result.failure.find("overlap") != std::string::npos;
    overlap ? void(++tally.overlaps) : tally.failures.push_back(result.failure);
    return;
  }
  note(result);
  for (const LedgerEntry& entry : result.ledger.entries) {
    if (entry.kind != LedgerEntry::Kind::conservation || entry.pass()) continue;
    RC_FAIL("ledger: " + entry.name + " is " + std::to_string(entry.value / entry.bound) + " bounds");
  }
  if (!grapnel::test::kSanitized) require_same(result, simulate_capture(problem));
}

TEST(RandomContacts, LedgerPasses) {
  const bool passed =
      passes_on_random("bodies touch, and the ledger passes", contact_text(), GRAPNEL_RANDOM_CONTACTS, check);
  EXPECT_TRUE(passed);
  std::printf(
      "[ measured ] %d runs: %d overlap at the start, %d completed, %d touching, %d with hard impacts, %d captured, %d "
      "lost a grasp; slowest %.3f s\n",
      tally.runs, tally.overlaps, tally.completed, tally.touching, tally.impacts, tally.captured, tally.lost,
      tally.slowest);
  for (const std::string& failure : tally.failures) std::printf("[ measured ] stopped: %s\n", failure.c_str());
  if (!passed) return;
  EXPECT_GE(4 * tally.touching, tally.runs);
  EXPECT_LE(4 * tally.failures.size(), static_cast<std::size_t>(tally.runs));
}

}  // namespace random_contact_test
}  // namespace grapnel::testing
