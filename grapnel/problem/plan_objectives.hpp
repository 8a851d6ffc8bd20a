#pragma once

/// @file
/// The objectives of a plan: each with its weight, its unit and a description. One row per objective.

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

struct PlanObjective {
  PlanSetup::Objective objective;
  double PlanWeights::*weight;
  const char* unit;
  const char* description;
};

inline constexpr PlanObjective kPlanObjectives[] = {
    {PlanSetup::Objective::excursion, &PlanWeights::excursion, "rad^2",
     "half the sum of squares of the joints' displacements"},
    {PlanSetup::Objective::nearest, &PlanWeights::nearest, "rad^2",
     "half the sum of squares of the distances from plan.guess"},
    {PlanSetup::Objective::limits, &PlanWeights::limits, "1",
     "half the sum of squares of the distances from the middles of the joints' ranges"},
    {PlanSetup::Objective::manipulability, &PlanWeights::manipulability, "1",
     "minus the logarithm of the manipulability of the arms"},
    {PlanSetup::Objective::effort, &PlanWeights::effort, "(N m)^2",
     "half the mean of the sum of squares of the joints' efforts during the approach"},
    {PlanSetup::Objective::base_attitude, &PlanWeights::base_attitude, "rad^2",
     "half the square of the base's rotation at the capture"},
    {PlanSetup::Objective::base_motion, &PlanWeights::base_motion, "rad^2",
     "half the mean square of the base's angular velocity, times the square of the segment's duration"},
    {PlanSetup::Objective::clearance, &PlanWeights::clearance, "m", "minus the minimum clearance during the approach"},
    {PlanSetup::Objective::impulse, &PlanWeights::impulse, "J",
     "energy that each impulse of the capture alone would give the free targets"},
    {PlanSetup::Objective::impulse_index, &PlanWeights::impulse_index, "1",
     "impulse of the relative motions at the grasps with an immovable robot, mean over directions"},
    {PlanSetup::Objective::wheel_momentum, &PlanWeights::wheel_momentum, "1",
     "half the mean of the sum of squares of the wheels' momenta over their maximum momenta, during the approach"},
};

/// The weight of an objective in a plan; zero: not minimized.
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
