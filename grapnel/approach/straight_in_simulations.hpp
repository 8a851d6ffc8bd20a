#pragma once

/// @file
/// Forward simulations of plans with a final straight approach: final errors, the recorded motion of servicer and
/// targets, and the iteration that corrects the plan by them.

#include <functional>
#include <vector>

#include "grapnel/approach/planning_task.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// Final errors of the end-effectors relative to their goals of the straight approach.
using Gaps = std::vector<GoalGap>;
double largest_of(const Gaps& gaps);
Gaps simulated_gaps(const PlanningTask& task, const StraightInProblem& in, const State& end);

/// Plan => final errors of its simulation, and in `around` the centre of mass, momentum and residual angular velocity
/// of the servicer as Chebyshev series of time.
Gaps simulate_approach(PlanningTask& task, const PlanDraft& draft, const StraightInProblem& in,
                       StraightInSurroundings& around);
/// Targets at the capture => their motion during the straight approach under loads, orbital field and contacts,
/// propagated backwards and stored as Chebyshev series; quaternions have the same sign from sample to sample.
std::function<std::vector<FreeBody>(double time)> targets_over(const PlanningTask& task, const StraightInProblem& in);

/// One correction: `plan` extends the draft and returns the errors of the plan itself, which no correction removes;
/// `correct` receives the additional errors of the simulation.
struct BySimulations {
  std::function<Gaps()> plan, simulate;
  std::function<void(const Gaps&)> correct;
};
struct SimulatedErrors {
  Gaps gaps;
  double beside = 0;  // largest error beyond that of the plan [m, rad, m/s, rad/s]
};
/// Draft, steps and their maximum number => draft extended by the best plan, and its errors. Ends within tolerance or
/// after three corrections without improvement; passes Unplannable of the first plan.
SimulatedErrors correct_by_simulations(PlanDraft& draft, const BySimulations& steps, int max_corrections);

}  // namespace grapnel
