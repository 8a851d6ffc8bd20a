#pragma once

/// @file
/// Arms as near to their goals as they go, in the sense of least squares of the goals' error [m and rad]: what is left
/// where goals cannot be reached.

#include "grapnel/plan/arm_starts.hpp"

namespace grapnel {

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

}  // namespace grapnel
