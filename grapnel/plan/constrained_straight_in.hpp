#pragma once

/// @file
/// Final straight approach with limits enforced by self-motion.
///
/// The end-effector trajectories are given. The joint trajectories are determined except for self-motions, which exist
/// if there are more joints than rows, or if the roll about the approach direction is free. A self-motion z(t), (2) of
/// straight_in.hpp, gives the joint rates
///   theta_dot = z + G^+ (b - G z)                                                                                  (1)
/// with G theta_dot = b the rows of the goals. With y = (theta, xi), xi a displacement of the base in B, derivatives
/// with respect to the coefficients c of z and to the initial state follow
///   dtheta' = rho_theta dtheta + rho_xi xi + (1 - G^+ G) phi_k dc_k                                                (2)
///   xi' = A xi + V_theta dtheta + V_rate dtheta'                                                                   (3)
/// with rho's derivatives from (1) of goal.hpp, A and the base's twist V from (3) of floating_base.hpp. The problem is
///   min |c|^2   with   g_i(c; t) <= 0 for all t                                                                    (4)
/// |c|^2 is the mean square of z, since the phi_k are orthonormal; the g_i are the constraints of PathConstraintCheck.
/// It is solved by sequential quadratic programming. The g_i are linearized by (2) and (3) at the instants at which an
/// iterate nearly violates them; the nearest c that satisfies the linearization is a least-distance program. The
/// Hessian of (4) is the identity and needs no estimate. A step moves each joint by at most half a radian; the bounds
/// of all rows are relaxed equally by the amount that this requires, and the linearization predicts the remaining
/// violation. The search first finds any feasible c, then the minimum near it. The result is integrated exactly and
/// checked between the nodes. If a violation there exceeds the tolerance, the constraints are tightened by that amount.

#include <optional>

#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// Alternative initial states of the final straight approach: consistent joint values and base displacements that leave
/// the end-effectors in place, to first order.
struct StartFreedom {
  Eigen::MatrixXd position;  // joints x k
  Matrix6Xd displacement;    // 6 x k, of the base in B
};
/// Of the segment that `reach` describes, at a solution of it.
StartFreedom start_freedom(FloatingBase& base, const ReachProblem& reach, const ReachSolution& solution);

struct ConstrainedStraightIn {
  bool kept = false;
  StraightInPath path;     // exact, with the self-motion; empty if only the nodes were evaluated (not kept)
  SelfMotion self_motion;  // empty if the minimum-norm rates suffice
  std::string trouble;     // if not kept: the largest violation, its value and time
  double violation = 0;
  PathFigures figures;
  int self_motions = 0;       // maximum number of independent self-motions along the approach
  std::vector<double> start;  // other initial joint values to use, if there is freedom to choose them
  long rhs_evaluations = 0;
};

/// Finds the final straight approach with the minimum self-motion that satisfies the path constraints of `kept` (its
/// limits, motion and constraints are read), or the one closest to satisfying them. With `freedom` the approach may
/// begin elsewhere; then only ConstrainedStraightIn::start is set: the initial joint values that satisfy the
/// constraints to first order in the freedom.
ConstrainedStraightIn constrain_straight_in(FloatingBase& base, const StraightInProblem& problem,
                                            const ReachProblem& kept, const StartFreedom* freedom = nullptr);

}  // namespace grapnel
