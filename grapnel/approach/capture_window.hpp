#pragma once

/// @file
/// When to capture: the time within CaptureWindow at which a plan exists and is best. The one place that makes of a
/// problem with a window one with a duration; everything after it knows durations only.
///
/// Times that are looked at: from the earliest on in steps, and the latest. At each of them, cheapest first:
///   1. Distance. Where nothing from outside moves the servicer's centre of mass, no arm brings an end-effector farther
///      from it than its reach_bound().
///   2. Direction. Where a grasp asks for its approach direction, one that leads back towards the arm is not free.
///   3. The plan itself, as the run with that duration makes it: nothing is handed on from one time to the next, so
///      that a scenario with the chosen duration has the same plan. After a time without a plan the next is first tried
///      from where that search came to rest, since one that fails altogether costs ten times one that does not.
/// The best of them is refined between its neighbours: by golden section for what is least, by bisection for the first
/// that can be reached, to a thousandth of the step.

#include <string>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

struct CaptureTime {
  CaptureProblem problem;  // with the chosen time as its duration, and no window
  WindowReport window;
  /// Not empty: nothing can be reached within the window, and why; the problem then has the time that comes nearest,
  /// and `closest` what planning said there, where it came so far.
  std::string failure;
  PlanReport closest;
  long rhs_evaluations = 0;  // of all plans together
};

/// The problem has an approach with a window. Plans are made on estimates, where targets have them. Counts as one
/// search: PlanSetup::max_evaluations bounds the plans of all times together, of which `progress` is told.
/// @throws CaptureProblemError where the problem contradicts itself, std::runtime_error if an integration fails.
CaptureTime choose_capture_time(const CaptureProblem& problem, const CaptureProgress& progress = {});

}  // namespace grapnel
