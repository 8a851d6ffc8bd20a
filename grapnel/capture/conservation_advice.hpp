#pragma once

/// @file
/// What to do about a check of conservation that fails: advice that fits the cause. Thread safety: pure functions.

#include "grapnel/capture/capture_problem.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel {

/// Where the largest deviations of momentum came in.
struct DriftCause {
  bool in_impact = false;   // at an instant, not in motion
  bool integrated = false;  // in a phase whose momentum is integrated instead of recovered
};

/// Fills in LedgerEntry::advice of every row of conservation that fails.
void advise(const CaptureProblem& problem, const DriftCause& drift, Ledger& ledger);

}  // namespace grapnel
