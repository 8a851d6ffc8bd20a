#pragma once

/// @file
/// Choice of the capture time: the time within CaptureWindow at which a plan exists and the objective is optimal.
/// Converts a problem with a window into one with a duration; all later stages use durations only.
///
/// Candidate times run from the earliest time in steps, and include the latest. Each candidate passes three checks, in
/// order of cost:
///   1. Distance. If no external load moves the servicer's centre of mass, no arm reaches farther from it than its
///      reach_bound().
///   2. Direction. If a grasp has an approach direction, a direction that leads back towards the arm is rejected.
///   3. The plan itself, identical to that of a run with this duration. No result is reused between candidates, so a
///      scenario with the chosen duration has the same plan. After a candidate without a plan, the next search starts
///      from the final iterate of the failed one: a failed search costs ten times a successful one.
/// The best candidate is refined between its neighbours to a thousandth of the step: by golden section for a minimum,
/// by bisection for the earliest feasible time.

#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

struct CaptureTime {
  CaptureProblem problem;  // with the chosen time as its duration, and no window
  WindowReport window;
  /// Not empty: no capture is feasible within the window, with the cause. The problem then has the time closest to
  /// feasibility, and `closest` the plan's message there, if a plan was attempted.
  std::string failure;
  PlanReport closest;
  long rhs_evaluations = 0;  // of all plans
};

/// Chooses the capture time of a problem that has an approach with a window. Plans use estimates of the targets if
/// present. The whole choice counts as one search: PlanSetup::max_evaluations limits all its plans together, and
/// `progress` reports them. @throws CaptureProblemError if the problem is inconsistent, std::runtime_error if an
/// integration fails.
CaptureTime choose_capture_time(const CaptureProblem& problem, const CaptureProgress& progress = {});

}  // namespace grapnel
