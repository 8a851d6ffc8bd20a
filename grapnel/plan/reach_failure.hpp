#pragma once

/// @file
/// Diagnosis of unreachable goals, with messages for the user.

#include <optional>
#include <string>

#include "grapnel/plan/arm_starts.hpp"
#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/shooting.hpp"

namespace grapnel {

// Least-squares solutions of the goals' error [m and rad]: the remaining error of unreachable goals.

/// The closest attempt of an arm with a fixed base.
struct Nearest {
  Eigen::VectorXd error;  // of the arm's goals
  Eigen::MatrixXd J;      // Jacobian, one column per joint of the arm
};

/// Least squares within the joint limits (NLopt's SLSQP), starting from `theta`, with the base fixed at X_WB. `theta`
/// has one value per joint; the values of this arm are overwritten with the result.
Nearest approach_goals(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                       std::vector<double>& theta);

/// Least-squares solutions of all arms, at the base pose that results from the motion to them with zero final rates.
struct SettledArms {
  std::vector<Arm> arms;
  std::vector<Nearest> nearest;  // per arm
  std::vector<double> theta;
  Posed X_WB = Posed::identity();
};
/// Alternates between the least-squares problem of each arm and the integration of the base motion, from several
/// initial guesses. Each arm is solved separately; no arm deviates from its optimum to help another one through the
/// base motion. `theta` (one value per joint): the first initial guess.
SettledArms settle_arms(FloatingBase& base, const ReachProblem& problem, std::vector<double> theta);

// Compatibility of several goals on one target, independent of the base motion: the closed chain through the target
// constrains the joints alone.

/// The closest attempt for some goals with free joints and a free base: the minimum sum of squares of the goals' error
/// [m and rad] found from several initial guesses (NLopt's SLSQP), joints within their limits.
struct ClosestTogether {
  Eigen::VectorXd error;      // of the goals
  std::vector<double> theta;  // all joints
  Posed X_WB = Posed::identity();
};
/// `theta` (one value per joint): joint values of the first initial guess; the base starts at the pose of the segment's
/// begin.
ClosestTogether closest_together(FloatingBase& base, const ReachProblem& problem, std::span<const Goal> goals,
                                 const std::vector<double>& theta);

/// Grasp points on one target that the end-effectors cannot reach simultaneously.
struct Incompatible {
  std::vector<std::size_t> goals;  // indices into the problem's goals
  std::string text;  // message: the end-effectors, the distance between their grasp points and the remaining gap
};
/// Checks every pair of goals with the same target, then all goals of a target whose pairs are all compatible.
/// Positions are checked first, then positions with orientations. Empty if no incompatibility is found or no two goals
/// share a target.
std::vector<Incompatible> incompatible_goals(FloatingBase& base, const ReachProblem& problem,
                                             const std::vector<double>& theta);

/// Message: by how much base and target must approach for a goal beyond the length of its arm, with the base at X_WB.
/// Empty if the goal is within that length.
std::string beyond_reach(FloatingBase& base, const Posed& X_WB, const Goal& goal);

/// Distances and angles of the goals in an error vector (empty vector: zeros).
std::vector<GoalMiss> misses(std::span<const Goal> goals, const Eigen::VectorXd& error);

struct Failure {
  std::string text;
  std::vector<GoalMiss> miss;  // per goal, the smallest found
};

/// Explains why the goals are not reached. The message first lists incompatible grasp points on one target with the
/// remaining gap (incompatible_goals). Then one sentence per end-effector that misses its goal states the minimum
/// distance and the cause: arm length, other end-effectors on the same joints, joint limits or a singularity. Each arm
/// is evaluated at its least-squares solution, at the base pose that results from a motion to rest there (settle_arms);
/// rates are not considered. `closest`: the best attempt of the search, after `tried` initial guesses.
Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const ShootingIterate& closest, int tried);

}  // namespace grapnel
