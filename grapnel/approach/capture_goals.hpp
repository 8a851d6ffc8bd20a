#pragma once

/// @file
/// From a problem's grasps to goals of planning.

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/measure.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// One goal per grasp: its end-effector at its grasp point, the targets moving as at the capture. `model` is the
/// servicer's.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets);

/// The same for the last piece straight in; StraightGoal::target counts in CaptureProblem::targets.
std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model);

/// What the final rates of an approach are to do.
RateDemand rate_demand(const ApproachSetup& approach);

/// The measure of a plan as planning knows it, and its name as files and results have it.
Measure::Kind kind_of(PlanSetup::Measure measure);
const char* name_of(PlanSetup::Measure measure);

}  // namespace grapnel
