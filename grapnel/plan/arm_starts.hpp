#pragma once

/// @file
/// Initial guesses of final joint values: solutions of the inverse kinematics of each arm with a fixed base.

#include <random>

#include "grapnel/model/model.hpp"
#include "grapnel/plan/reach.hpp"

namespace grapnel {

// Maximum reach of an arm.

/// Maximum distance from the first joint of a frame's chain to the frame, with prismatic joints at their limits, and
/// the body of that joint. For a chain without joints: body -1 and the distance from the base's origin. Infinite for a
/// prismatic joint without limits.
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

/// Inverse kinematics of an arm with the base fixed at X_WB, by damped Newton steps from `theta` (all joints; those of
/// the arm are overwritten). Returns whether the error is below 1e-6 [m and rad].
bool still_base_ik(FloatingBase& base, const Posed& X_WB, const Arm& arm, const ReachProblem& problem,
                   std::vector<double>& theta);

class ArmStarts {
 public:
  /// Solves the inverse kinematics of each arm from many random initial guesses, with the base at X_WB, and ranks the
  /// solutions by the problem's objective.
  ArmStarts(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB);
  /// The next initial guess: first the best solution of every arm, then the others in turn; random values for an arm
  /// without a solution.
  std::vector<double> next();
  /// Whether every arm has a solution.
  bool complete() const;

 private:
  struct Solved {
    Arm arm;
    std::vector<std::vector<double>> solutions;  // per solution, per joint of the arm; best first
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
