#pragma once

/// @file
/// Solves the impact of a contact and writes its report. Thread safety: pure functions.

#include "grapnel/capture/contact.hpp"
#include "grapnel/impact/impulse_reactions.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

struct ImpactOutcome {
  ImpactReport report;
  ImpactSolution solution;
  State after;                                // configuration of the contact, velocities after the impact
  Momentumd from_ground = Momentumd::zero();  // what a fixed base's mount put in, about the world's origin, in W
};
ImpactOutcome run_impact(const CaptureProblem& problem, const CaptureSystem& system, const Contact& contact,
                         double time);

/// Relative momentum errors of the published formulas, once the ledger's scales are known.
void scale_published(const LedgerScale& scale, ImpactReport& report);

}  // namespace grapnel
