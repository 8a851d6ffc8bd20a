#pragma once

/// @file
/// Where a search for final joint values may begin: solutions of the inverse kinematics arm by arm with the base kept
/// still. Thread safety: one thread at a time.

#include <random>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

class ArmStarts {
 public:
  /// Solves each arm (goals whose chains share joints belong together) from many random beginnings, with the base at
  /// X_WB, and orders its solutions by the problem's measure.
  ArmStarts(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB);
  /// The next beginning: first every arm's best, then the others in turn; where an arm has no solution, random values.
  std::vector<double> next();

 private:
  struct Arm {
    std::vector<Goal> goals;
    std::vector<int> joints;
    std::vector<std::vector<double>> solutions;  // per solution, per joint of the arm; the best first
  };
  void split_arms();
  void solve(Arm& arm, const Posed& X_WB);
  std::vector<double> random_values();
  double uniform();

  FloatingBase& base_;
  const ReachProblem& problem_;
  std::vector<Arm> arms_;
  std::mt19937_64 random_;
  std::size_t served_ = 0;
};

}  // namespace grapnel
