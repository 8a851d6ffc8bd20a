#pragma once

/// @file
/// Where a search for final joint values may begin: solutions of the inverse kinematics arm by arm with the base kept
/// still.

#include <random>

#include "grapnel/model/model.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

// How far an arm reaches.

/// The longest way from the first joint of a frame's chain to the frame, prismatic joints at their limits, and that
/// joint's body. A chain without joints: body -1, and the way from the base's origin. Infinite with a prismatic joint
/// without limits.
struct ArmReach {
  int first_body = -1;
  double length = 0;  // [m]
};
ArmReach arm_reach(const Model& model, int frame);

/// Goals whose chains share joints, and these joints.
struct Arm {
  std::vector<Goal> goals;
  std::vector<int> joints;
};
std::vector<Arm> split_arms(const FloatingBase& base, std::span<const Goal> goals);

/// Inverse kinematics of an arm with the base still at X_WB, by damped Newton steps from `theta` (all joints; those of
/// the arm are changed). Whether it arrives within 1e-6 [m and rad].
bool still_base_ik(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                   std::vector<double>& theta);

class ArmStarts {
 public:
  /// Solves each arm from many random initial guesses, with the base at
  /// X_WB, and orders its solutions by the problem's objective.
  ArmStarts(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB);
  /// The next initial guess: first every arm's best, then the others in turn; where an arm has no solution, random
  /// values.
  std::vector<double> next();
  /// Whether every arm has a solution.
  bool complete() const;

 private:
  struct Solved {
    Arm arm;
    std::vector<std::vector<double>> solutions;  // per solution, per joint of the arm; the best first
  };
  void solve(Solved& solved, const Posed& X_WB);
  std::vector<double> random_values();
  double uniform();

  FloatingBase& base_;
  const ReachProblem& problem_;
  std::vector<Solved> arms_;
  std::mt19937_64 random_;
  std::size_t served_ = 0;
};

}  // namespace grapnel
