#pragma once

/// @file
/// The final straight approach (section 6.3 of docs/theory): the motion to the stand-off, then along the approach
/// direction in the tumbling target's frame. Disturbances and flexible links are compensated by simulations.

#include <vector>

#include "grapnel/approach/planning_task.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// Extends the draft to the stand-off at time `begin` and from there to the capture. @throws Unplannable.
void plan_straight_approach(PlanningTask& task, PlanDraft& draft, double begin);

/// The stand-off: the configuration at which the final straight approach begins.
struct PlannedStandOff {
  ReachProblem reach;
  ReachSolution solution;
};
/// Straight approach => joints at its stand-off, and the problem that they solve; with path constraints also the
/// self-motion (6.9a) of the straight approach, stored in `in`, with which it satisfies them. `guess`: first guess of
/// the search; empty: that of approach.plan. @throws Unplannable if there is none.
PlannedStandOff plan_stand_off(PlanningTask& task, PlanDraft& draft, StraightInProblem& in,
                               const std::vector<double>& guess);

}  // namespace grapnel
