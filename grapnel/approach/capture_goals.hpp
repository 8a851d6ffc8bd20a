#pragma once

/// @file
/// From a problem's grasps to goals of planning.

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/objective.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// One goal per grasp: its end-effector at its grasp point, the targets moving as at the capture. `model` is the
/// servicer's.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets);

/// The same for the last piece straight in; StraightGoal::target counts in CaptureProblem::targets.
std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model);

/// What the final rates of an approach are to do.
RateDemand rate_demand(const ApproachSetup& approach);

/// The objective of a plan as planning knows it.
Objective::Kind kind_of(PlanSetup::Objective objective);

}  // namespace grapnel
