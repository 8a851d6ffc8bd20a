#pragma once

/// @file
/// Why goals cannot be reached, in words.

#include <optional>
#include <string>

#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {

// Arms as near to their goals as they go, in the sense of least squares of the goals' error [m and rad]: what is left
// where goals cannot be reached.

/// The closest attempt of an arm with the base still.
struct Nearest {
  Eigen::VectorXd error;  // of the arm's goals
  Eigen::MatrixXd J;      // per joint of the arm
};

/// Least squares within the joints' limits (NLopt's SLSQP) from `theta` (all joints; those of the arm are changed to
/// the result), the base still at X_WB.
Nearest approach_goals(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                       std::vector<double>& theta);

/// All arms as near as they go, with the base where that motion, ending at rest, takes it.
struct SettledArms {
  std::vector<Arm> arms;
  std::vector<Nearest> nearest;  // per arm
  std::vector<double> theta;
  Posed X_WB = Posed::identity();
};
/// Alternates between the arms' least squares, from several initial guesses, and flights there. Every arm by itself: an
/// arm does not give way so that the base's motion helps another. `theta` (one per joint): the first initial guess.
SettledArms settle_arms(FloatingBase& base, const ReachProblem& problem, std::vector<double> theta);

// Whether several end-effectors can be at their places on one target at once, wherever the base may be: a closed chain
// through the target asks it of the joints alone, whatever the momentum does with the base.

/// The closest attempt of some goals with joints and base free: the least sum of squares of the goals' error [m and
/// rad] that was found from several initial guesses (NLopt's SLSQP), joints within their limits.
struct ClosestTogether {
  Eigen::VectorXd error;      // of the goals
  std::vector<double> theta;  // all joints
  Posed X_WB = Posed::identity();
};
/// `theta` (one per joint): where the first initial guess has the joints; the base begins at the segment's start.
ClosestTogether closest_together(FloatingBase& base, const ReachProblem& problem, std::span<const Goal> goals,
                                 const std::vector<double>& theta);

/// Places on one target that end-effectors cannot be at together.
struct Incompatible {
  std::vector<std::size_t> goals;  // indices into the problem's
  std::string text;                // who cannot be where, how far apart these are, and the gap that remains
};
/// Looks at every pair of goals with the same target, and at all goals of a target of which every pair fits. First by
/// distances alone, then with the orientations asked for. Empty if nothing speaks against them, or no two goals share a
/// target.
std::vector<Incompatible> incompatible_goals(FloatingBase& base, const ReachProblem& problem,
                                             const std::vector<double>& theta);

/// How much nearer base and target must be for a goal beyond the length of its arm, with the base at X_WB, in words;
/// empty: it is within that.
std::string beyond_reach(FloatingBase& base, const Posed& X_WB, const Goal& goal);

/// Distances and angles of the goals in an error vector (empty: zeros).
std::vector<GoalMiss> misses(std::span<const Goal> goals, const Eigen::VectorXd& error);

struct Failure {
  std::string text;
  std::vector<GoalMiss> miss;  // per goal, the closest that was found
};

/// Places on one target that no motion of joints and base brings together, with the gap that remains and between what
/// (incompatible_goals). Then one sentence per end-effector that does not arrive: its closest miss, and the reach, the
/// other hands on the same joints, the joint limits or the singularity that stops it there. Each arm by itself is
/// brought as near as it goes, with the base where that motion, ending at rest, takes it (settle_arms); rates play no
/// part in it. `closest`: the best attempt of the search, after `tried` initial guesses.
Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const Shot& closest, int tried);

}  // namespace grapnel
