#pragma once

/// @file
/// Free-floating inverse kinematics: final joint values and rates of a segment such that the momentum-conserving motion
/// brings every end-effector to its goal.
///
/// Where the end-effectors end depends on the base, and the base on the whole way there (its angular momentum is a
/// non-holonomic constraint), so this is a boundary value problem: with e(theta_f, rate_f) the goals' error,
///   e = 0,   rate_f = rho(theta_f, X_WB)                                                            (1)
/// where rho are the rates that the generalized Jacobian demands at the end, and X_WB(theta_f, rate_f) the integral of
/// the momentum equation (PathSegment), sensitivities included. At every iterate rate_f is settled first, by Newton's
/// method in the six directions of the base; then
///   de/dtheta_f = E_theta + E_xi (xi_theta + xi_rate K),
///   K = d rate_f/d theta_f = (1 - rho_xi xi_rate)^-1 (rho_theta + rho_xi xi_theta)                  (2)
/// gives Newton steps of least norm within the joints' limits. Initial guesses besides the stated one come from inverse
/// kinematics arm by arm with the base kept still, which costs no integration. Among solutions an objective decides,
/// improved by sequential quadratic programming (NLopt's SLSQP; Kraft 1994) with e = 0 and the rate limits as
/// constraints, and polished by Newton again; a solution within the rate limits is better than any beyond them.

#include <cstdint>
#include <string>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/path_segment.hpp"
#include "grapnel/plan/way.hpp"

namespace grapnel {

struct ReachProblem {
  SegmentStart start;
  FreeMotion motion;
  std::vector<Goal> goals;
  RateDemand demand = RateDemand::twist;
  std::vector<double> given_rates;   // per joint, for RateDemand::given; empty: zero
  std::vector<double> lower, upper;  // of final joint values; infinite where there are none
  std::vector<double> rate_limit;    // of the sizes of final rates; infinite where there are none; empty: none
  Objective objective;
  WaySetup way;
  std::vector<double> guess;  // where the search begins
  int starts = 16;            // at most so many initial guesses, the guess among them
  std::uint64_t seed = 0;
};

/// Where one goal was left.
struct GoalMiss {
  double distance = 0;  // [m]
  double angle = 0;     // of what the orientation asks for [rad]
};

struct ReachSolution {
  bool found = false;
  bool approximate = false;            // found only to what the goals accept
  std::vector<double> position, rate;  // final, per joint; of the closest attempt if not found
  int knots = 0;                       // of the joints' splines, and their coefficients, as in PathSegment::fly
  std::vector<double> coefficients;
  std::optional<WayFigures> way;   // where something is asked of the way
  Posed X_WB = Posed::identity();  // of the base at the end
  std::vector<GoalMiss> miss;      // per goal
  bool within_rate_limits = true;  // whether the final rates are
  double unmet_rate = 0;           // largest component of the demanded motion that no joint rates give
  double objective = 0;            // NaN where it depends on a way that was not looked at
  std::vector<double> terms;       // of it, in the order of Objective::terms(), without weights; NaN likewise
  int starts = 0;                  // initial guesses tried
  int solutions = 0;               // of them that led to a solution
  int distinct = 0;                // solutions that differ by more than 1e-3 in a joint [rad or m]
  int iterations = 0;              // Newton's, over all initial guesses
  long rhs_evaluations = 0;
  double smallest_singular_value = 0;  // of the goals' error against final joint values, where it is not structural
  std::string failure;                 // if not found: which end-effector misses by how much, and what stops it
};

/// Solves the problem. `base` is scratch. Never throws for unreachable goals; @throws std::invalid_argument if sizes do
/// not fit the model.
ReachSolution plan_reach(FloatingBase& base, const ReachProblem& problem);

/// Errors below this count as arrived [m and rad].
inline constexpr double kArrived = 1e-10;

}  // namespace grapnel
