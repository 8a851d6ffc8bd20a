#pragma once

/// @file
/// Why goals cannot be reached, in words.

#include "grapnel/plan/shooting.hpp"

namespace grapnel {

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
