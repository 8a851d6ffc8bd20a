#pragma once

/// @file
/// Free-floating inverse kinematics. Computes the final joint values and rates of a segment such that the
/// momentum-conserving motion brings every end-effector to its goal.
///
/// The final end-effector poses depend on the base pose, and the base pose depends on the whole joint trajectory
/// because conservation of angular momentum is a non-holonomic constraint. This is therefore a boundary value problem.
/// With e(theta_f, rate_f) the error of the goals,
///   e = 0,   rate_f = rho(theta_f, X_WB)                                                            (1)
/// where rho are the final rates demanded through the generalized Jacobian, and X_WB(theta_f, rate_f) is the integral
/// of the momentum equation (PathSegment), computed with its sensitivities. At every iterate, Newton's method in the
/// six coordinates of the base first determines rate_f. Then
///   de/dtheta_f = E_theta + E_xi (xi_theta + xi_rate K),
///   K = d rate_f/d theta_f = (1 - rho_xi xi_rate)^-1 (rho_theta + rho_xi xi_theta)                  (2)
/// gives minimum-norm Newton steps within the joint limits. Further initial guesses come from inverse kinematics of
/// each arm with a fixed base, which needs no integration. The objective selects among the solutions. Each solution is
/// improved by sequential quadratic programming (NLopt's SLSQP; Kraft 1994) with e = 0 and the rate limits as
/// constraints, and refined by Newton's method. A solution within the rate limits is preferred to any solution that
/// exceeds them.

#include <cstdint>
#include <string>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/path_constraints.hpp"
#include "grapnel/plan/path_segment.hpp"

namespace grapnel {

struct ReachProblem {
  SegmentStart start;
  FreeMotion motion;
  std::vector<Goal> goals;
  RateDemand demand = RateDemand::twist;
  std::vector<double> given_rates;   // per joint, for RateDemand::given; empty: zero
  std::vector<double> lower, upper;  // bounds of the final joint values; infinite: no bound
  std::vector<double> rate_limit;    // bounds of |final rate|; infinite: no bound; empty: no bounds
  Objective objective;
  PathConstraints constraints;
  std::vector<double> guess;  // first initial guess of the search
  int starts = 16;            // maximum number of initial guesses, including `guess`
  std::uint64_t seed = 0;
};

/// Remaining error of one goal.
struct GoalMiss {
  double distance = 0;  // [m]
  double angle = 0;     // of the constrained part of the orientation [rad]
};

struct ReachSolution {
  bool found = false;
  bool approximate = false;            // found only within the goals' accepted errors
  std::vector<double> position, rate;  // final, per joint; of the closest attempt if not found
  int knots = 0;                       // inner knots and coefficients of the joint splines: PathSegment::integrate
  std::vector<double> coefficients;
  std::optional<PathFigures> figures;  // set if the problem has path constraints or an objective of the path
  Posed X_WB = Posed::identity();      // final base pose
  std::vector<GoalMiss> miss;          // per goal
  bool within_rate_limits = true;      // whether the final rates are within their limits
  double unmet_rate = 0;               // largest component of the demanded motion that no joint rates produce
  double objective = 0;                // NaN if it depends on a path that was not evaluated
  std::vector<double> terms;  // of the objective, in the order of Objective::terms(), without weights; NaN as above
  int starts = 0;             // initial guesses tried
  int solutions = 0;          // number of initial guesses that led to a solution
  int distinct = 0;           // solutions that differ by more than 1e-3 in a joint [rad or m]
  int iterations = 0;         // Newton iterations over all initial guesses
  long rhs_evaluations = 0;
  double smallest_singular_value = 0;  // of d(error)/d(final joint values), structural zeros excluded
  std::string failure;                 // if not found: which end-effector misses, by how much, and the cause
};

/// Solves the problem. `base` is scratch. Unreachable goals do not throw; see ReachSolution::failure. @throws
/// std::invalid_argument if sizes do not match the model.
ReachSolution plan_reach(FloatingBase& base, const ReachProblem& problem);

/// Convergence tolerance of the goals' error [m and rad].
inline constexpr double kArrived = 1e-10;

}  // namespace grapnel
