#pragma once

/// @file
/// Applies approach.plan to the search of a segment: objective, path constraints, initial guess.

#include "grapnel/approach/planning_task.hpp"

namespace grapnel {

/// approach.plan => search, objective and path constraints (6.20) of a segment from the end of the draft. A replanned
/// approach that begins beyond a limit gets a wider one, with a warning. @throws Unplannable if a setting cannot be
/// evaluated (wheel momentum without attitude control, clearance without pairs of bodies) or the begin of the segment
/// violates it.
void apply_plan_setup(PlanningTask& task, PlanDraft& draft, ReachProblem& reach);

}  // namespace grapnel
