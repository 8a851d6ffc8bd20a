#pragma once

/// @file
/// From a motion that violates what is asked of its way towards one that does not, whatever its objective.
///
/// With y = (theta_f, c) the unknowns of (1) of way.hpp, e the goals' errors and g_i what is violated, or nearly, at
/// instants on the way, a step d is the shortest that keeps what is linear of both:
///   min |d|^2   with   e + J d = 0,   g_i + (dg_i/dy) d <= left,   `left` as small as it gets                      (1)
/// a least-distance program (least_distance.hpp) in the null space of J. No unknown moves farther than a radius in a
/// step: the rows give way, all alike, as much as that takes. It ends where nothing is violated, where what is linear
/// says that no step makes it less, or where several steps have made it hardly less: what is left then is the least
/// near there, distances of bodies aside. A step takes one evaluation, where an optimizer with an objective takes
/// hundreds, so that demands that nothing meets are refused at once.

#include "grapnel/plan/way.hpp"

namespace grapnel {

/// The motion near `solution` that violates least; `knots` and `attempt` as in keep_way(). It ends once no more than
/// `enough` is violated at the nodes. Of the result `violation`, `trouble`, `shot` (null if nothing could be evaluated)
/// and the motion are set; the objective is not looked at.
WayEnd nearest_way(FloatingBase& base, const ReachProblem& problem, const Shot& solution, int knots, int attempt,
                   double enough);

}  // namespace grapnel
