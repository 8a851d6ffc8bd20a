#pragma once

/// @file
/// Whether several end-effectors can be at their places on one target at once, wherever the base may be: a closed chain
/// through the target asks it of the joints alone, whatever the momentum does with the base.

#include <optional>
#include <string>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

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

}  // namespace grapnel
