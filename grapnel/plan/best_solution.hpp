#pragma once

/// @file
/// The best solution near a given one: the objective made least while the goals stay met.

#include "grapnel/plan/shooting.hpp"

namespace grapnel {

/// Sequential quadratic programming (SLSQP) from `solution` with the goals' error as equality constraint, its dependent
/// rows left out, and the joints' limits as bounds. Ends near a solution; Newton's method has to polish it. Returns
/// `solution` where nothing better is found.
Shot best_near(FloatingBase& base, const ReachProblem& problem, Shooting& shooting, const Shot& solution);

}  // namespace grapnel
