#pragma once

/// @file
/// Why goals cannot be reached, in words. Thread safety: one thread at a time.

#include "grapnel/plan/shooting.hpp"

namespace grapnel {

/// Distances and angles of the goals in an error vector (empty: zeros).
std::vector<GoalMiss> misses(std::span<const Goal> goals, const Eigen::VectorXd& error);

struct Failure {
  std::string text;
  std::vector<GoalMiss> miss;  // per goal, the closest that was found
};

/// One sentence per end-effector that does not arrive: its closest miss, and the reach, the joint limits or the
/// singularity that stops it there. Each arm by itself is brought as near as it goes (least squares within its limits,
/// NLopt), with the base where that motion, ending at rest, takes it; rates play no part in it. `closest`: the best
/// attempt of the search.
Failure explain_failure(FloatingBase& base, const ReachProblem& problem, const Shot& closest);

}  // namespace grapnel
