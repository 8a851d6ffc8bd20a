#pragma once

/// @file
/// Converts a problem's grasps to planning goals.

#include <vector>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/straight_in.hpp"
#include "grapnel/problem/target_motion.hpp"

namespace grapnel {

/// One goal per grasp: its end-effector at its grasp point, for the target motion at the capture. `model` is the
/// servicer's.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets);

/// Likewise for the final straight approach; StraightGoal::target indexes CaptureProblem::targets.
std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model);

/// The demand on the final rates of an approach.
RateDemand rate_demand(const ApproachSetup& approach);

}  // namespace grapnel
