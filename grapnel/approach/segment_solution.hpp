#pragma once

/// @file
/// Solutions of segments: by momentum alone, and corrected by forward simulations where other effects act (section 6.2
/// of docs/theory). `what`: the segment in messages, such as ", stand-off".

#include <string>
#include <vector>

#include "grapnel/approach/planning_task.hpp"

namespace grapnel {

/// Solution without disturbances. @throws Unplannable if there is none.
ReachSolution solve_segment(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach, const std::string& what);
/// As above, for solutions that allow_for_disturbance() corrects afterwards. Goals beyond the reach of a
/// momentum-conserving base are searched for from the base pose that loads and the orbital field produce, if they move
/// the base by more than 1 cm or 0.01 rad.
ReachSolution solve_where_loads_lead(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                     const std::string& what);
/// Solution without disturbances => solution whose simulation meets the goals, by Newton's method on simulations. The
/// spline is unchanged; path constraints hold except for the effect of the changed final values, with a warning.
/// @throws Unplannable if the corrections do not converge.
ReachSolution allow_for_disturbance(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                    ReachSolution solution, const std::string& what);

/// Stated final joints => final rates: the stated ones (default zero), or the solution of (6.4) by Newton's method, by
/// simulations if the servicer is disturbed. @throws Unplannable if the undisturbed rates do not converge.
std::vector<double> settled_rates(PlanningTask& task, PlanDraft& draft, const ReachProblem& reach,
                                  const std::vector<double>& position);

}  // namespace grapnel
