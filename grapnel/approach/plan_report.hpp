#pragma once

/// @file
/// Report and warnings of a plan.

#include <vector>

#include "grapnel/approach/planning_task.hpp"
#include "grapnel/plan/goal.hpp"

namespace grapnel {

/// Solution of a search => report: objective and its terms, errors per end-effector, numbers of the search. If nothing
/// was found, the draft keeps the final values of the nearest iterate.
void report(const PlanningTask& task, PlanDraft& draft, const ReachProblem& reach, const ReachSolution& solution);
/// Final errors of the end-effectors.
void report_gaps(const std::vector<GoalGap>& gaps, PlanReport& report);
/// The contacts that the prediction contains, and what the plan assumes of others.
void report_contacts(const PlanningTask& task, ApproachPlan& plan);

/// Warns of goals that are met only within the envelopes of the grippers.
void warn_of_approximation(const ReachProblem& reach, const ReachSolution& s, ApproachPlan& plan);
/// Warns of a demanded final motion that no joint rates produce (`unmet`: its largest component), of final rates beyond
/// their limits, and of joints that overshoot by more than 2 pi rad or m, by the term T e(x) of (6.1). Call before the
/// final segment is added to the draft.
void warn_of_rates(const PlanningTask& task, PlanDraft& draft, const std::vector<double>& rates, double unmet,
                   double end);
/// Warns that simulations for corrections of the plan apply the attitude control's demand and the wheels, but no
/// thrusters.
void warn_of_thrusters(const PlanningTask& task, ApproachPlan& plan);

}  // namespace grapnel
