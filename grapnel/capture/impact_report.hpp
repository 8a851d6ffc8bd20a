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
/// `problem` has the grasps that take part, as `contact` lists them: those that close and those that hold already
/// (`already_closed` of them, at the front). `held`: rates that ideal drives keep.
ImpactOutcome run_impact(const CaptureProblem& problem, const CaptureSystem& system, const Contact& contact,
                         double time, std::size_t already_closed = 0, std::span<const HeldRate> held = {});

struct BrakeOutcome {
  BrakeReport report;
  State after;
  double energy_identity_residual = 0;
  Momentumd from_ground = Momentumd::zero();  // as in ImpactOutcome
};
/// Brakes stop joints (positions in system.robot_joints) at once. `problem` has the grasps that hold, `grasps` are
/// they; `driven`: rates that ideal drives of other joints keep.
BrakeOutcome run_brake(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                       std::span<const Grasp> grasps, std::span<const std::size_t> joints,
                       std::span<const HeldRate> driven);

/// Relative momentum errors of the published formulas, once the ledger's scales are known.
void scale_published(const LedgerScale& scale, ImpactReport& report);

}  // namespace grapnel
