#pragma once

/// @file
/// What a plan may make least. Files, problems and planning share it; what each is in numbers: Objective (goal.hpp) and
/// SegmentWay::objective(); its weight, unit and sentence for users: kPlanObjectives (problem/plan_objectives.hpp).

namespace grapnel {

/// excursion: the joints' motion on the way. nearest: squares of the distances from a guess. limits: squares of the
/// distances from the middle of the joints' ranges, relative to the ranges. manipulability: -log det of J_g J_g^T, arm
/// by arm (J_g: generalized Jacobian). as_found: nothing; Newton's method with steps of least norm from the guess, or
/// from the first other initial guess that leads to a solution. effort: squares of the joints' efforts, on the mean
/// over the way. base_attitude: the square of the base's turn at the capture. base_motion: squares of the base's
/// angular velocity on the way. clearance: minus the minimum distance on the way. impulse: the impulses of the capture,
/// as if the grasps were rigid; impulse_index: what any relative motion there would bring, on the mean of its
/// directions (both by the metric (7.8)). wheel_momentum: squares of what reaction wheels that keep the base's attitude
/// hold, over the most that they can, on the mean over the way.
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
