#pragma once

/// @file
/// Objectives that a plan may minimize, shared by files, problems and planning. Formulas: Objective (goal.hpp) and
/// ConstrainedSegment::objective(). Weights, units and descriptions for users: kPlanObjectives
/// (problem/plan_objectives.hpp).

namespace grapnel {

/// - excursion: motion of the joints along the path.
/// - nearest: sum of squared distances from a guess.
/// - limits: sum of squared distances from the middle of the joint ranges, relative to the ranges.
/// - manipulability: -log det of J_g J_g^T, summed over the arms (J_g: generalized Jacobian).
/// - as_found: no objective. Minimum-norm Newton steps from the guess, or from the first other initial guess that leads
/// to a solution.
/// - effort: time average of the sum of squared joint efforts.
/// - base_attitude: square of the base rotation at the capture.
/// - base_motion: square of the base's angular velocity along the path.
/// - clearance: minus the minimum distance along the path.
/// - impulse: impulses of the capture with rigid grasps.
/// - impulse_index: impulses for a relative motion averaged over its directions (both with the metric (7.8)).
/// - wheel_momentum: time average of the squared momenta of the reaction wheels that hold the base's attitude, relative
/// to their capacities.
enum class ObjectiveKind {
  excursion,
  nearest,
  limits,
  manipulability,
  as_found,
  effort,
  base_attitude,
  base_motion,
  clearance,
  impulse,
  impulse_index,
  wheel_momentum
};

}  // namespace grapnel
