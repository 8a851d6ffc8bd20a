#pragma once

/// @file
/// Feasibility restoration: moves from a motion that violates path constraints towards one that satisfies them, without
/// regard to the objective.
///
/// With y = (theta_f, c) the unknowns of (1) of path_constraints.hpp, e the goals' errors and g_i the violated or
/// nearly violated constraints, a step d is the minimum-norm solution of the linearization,
///   min |d|^2   with   e + J d = 0,   g_i + (dg_i/dy) d <= left,   with `left` minimal                             (1)
/// a least-distance program (least_distance.hpp) in the null space of J. A step radius bounds the change of every
/// unknown; the bounds of all rows are relaxed equally by the amount that this requires. The iteration ends if no
/// constraint is violated, if the linearization predicts no decrease, or if several steps decrease the violation only
/// slightly. The remaining violation is then a local minimum, except for distances of bodies. A step needs one
/// evaluation, an optimizer with an objective hundreds. Infeasible demands are therefore refused quickly.

#include "grapnel/plan/path_constraints.hpp"

namespace grapnel {

/// The motion with the smallest violation near `solution`; `knots` and `attempt` as in solve_with_path_constraints().
/// Stops if no violation at the nodes exceeds `enough`. Sets `violation`, `trouble`, `shot` (null if nothing could be
/// evaluated) and the motion of the result; the objective is not evaluated.
ConstrainedSolution nearest_feasible_path(FloatingBase& base, const ReachProblem& problem,
                                          const ShootingIterate& solution, int knots, int attempt, double enough);

}  // namespace grapnel
