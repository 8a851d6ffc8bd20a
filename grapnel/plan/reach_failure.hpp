#pragma once

/// @file
/// Why a goal cannot be reached, in words. Thread safety: as Shooting.

#include "grapnel/plan/shooting.hpp"

namespace grapnel {

/// Distances and angles of the goals in an error vector (empty: zeros).
std::vector<GoalMiss> misses(std::span<const Goal> goals, const Eigen::VectorXd& error);

/// One sentence per end-effector that does not arrive: its closest miss, and the reach, the joint limits or the
/// singularity that stops it there.
std::string explain_failure(FloatingBase& base, const ReachProblem& problem, Shooting& shooting, const Shot& closest);

}  // namespace grapnel
