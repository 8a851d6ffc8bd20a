#pragma once

/// @file
/// What a plan may minimize: each objective with its weight, its unit and what it is. One row per objective.

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

struct PlanObjective {
  PlanSetup::Objective objective;
  double PlanWeights::*weight;
  const char* unit;
  const char* description;
};

inline constexpr PlanObjective kPlanObjectives[] = {
    {PlanSetup::Objective::excursion, &PlanWeights::excursion, "rad^2", "half the sum of squares of the joints' ways"},
    {PlanSetup::Objective::nearest, &PlanWeights::nearest, "rad^2",
     "half the sum of squares of the distances from plan.guess"},
    {PlanSetup::Objective::limits, &PlanWeights::limits, "1",
     "half the sum of squares of the distances from the middles of the joints' ranges"},
    {PlanSetup::Objective::manipulability, &PlanWeights::manipulability, "1",
     "minus the logarithm of the manipulability of the arms"},
    {PlanSetup::Objective::effort, &PlanWeights::effort, "(N m)^2",
     "half the mean of the sum of squares of the joints' efforts on the way"},
    {PlanSetup::Objective::base_attitude, &PlanWeights::base_attitude, "rad^2",
     "half the square of the base's turn at the capture"},
    {PlanSetup::Objective::base_motion, &PlanWeights::base_motion, "rad^2",
     "half the mean square of the base's angular velocity, times the square of the segment's duration"},
    {PlanSetup::Objective::clearance, &PlanWeights::clearance, "m", "minus the minimum clearance on the way"},
    {PlanSetup::Objective::impulse, &PlanWeights::impulse, "J",
     "energy that the capture's impulses would give the free targets, each alone"},
    {PlanSetup::Objective::impulse_index, &PlanWeights::impulse_index, "1",
     "impulse of relative motions at the grasps, against an immovable robot, mean of their directions"},
    {PlanSetup::Objective::wheel_momentum, &PlanWeights::wheel_momentum, "1",
     "half the mean of the sum of squares of the wheels' momenta over the most that they can hold, on the way"},
};

/// With what weight a plan minimizes it; zero: not at all.
inline double weight_in(const PlanSetup& plan, const PlanObjective& one) {
  return plan.weights ? (*plan.weights).*one.weight : plan.objective == one.objective ? 1.0 : 0.0;
}
inline double weight_in(const PlanSetup& plan, PlanSetup::Objective objective) {
  for (const PlanObjective& one : kPlanObjectives) {
    if (one.objective == objective) return weight_in(plan, one);
  }
  return 0;
}

}  // namespace grapnel
