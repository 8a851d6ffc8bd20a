#pragma once

/// @file
/// The piece straight in, kept within limits by self-motion.
///
/// The hands' way is given, and with it the joints' but for what moves no hand: more joints than rows, or a turn about
/// the approach direction that is left free. A self-motion z(t), (2) of straight_in.hpp, makes the joints' rates
///   theta_dot = z + G^+ (b - G z)                                                                                  (1)
/// with G theta_dot = b the rows that the goals ask for. With y = (theta, xi), xi a displacement of the base in B,
/// derivatives with the coefficients c of z and with where the piece begins follow
///   dtheta' = rho_theta dtheta + rho_xi xi + (1 - G^+ G) phi_k dc_k                                                (2)
///   xi' = A xi + V_theta dtheta + V_rate dtheta'                                                                   (3)
/// with rho's derivatives by (1) of goal.hpp, A and the base's twist V by (3) of floating_base.hpp. Wanted is
///   min |c|^2   with   g_i(c; t) <= 0 for all t                                                                    (4)
/// |c|^2 being the mean square of z, since the phi_k are orthonormal, and the g_i what WayLook looks at. It is solved
/// by sequential quadratic programming: the g_i, at the instants at which an iterate comes near to violating them, made
/// linear by (2) and (3); the nearest c that keeps these, a least-distance program; and so on. The Hessian of (4) is
/// the identity, so that nothing has to be learned about it. Steps are no longer than joints move by half a radian:
/// rows give way for that, all alike, and what is linear of them foresees what is left. First anything is looked for
/// that keeps all, then the least near there. What comes out is integrated exactly and looked at between the nodes;
/// where more than a tolerance is missing there, that much more is asked for.

#include <optional>

#include "grapnel/plan/reach.hpp"
#include "grapnel/plan/straight_in.hpp"

namespace grapnel {

/// Where else the piece may begin: joint values and the base's displacement that go with each other and leave the hands
/// where they are, to first order.
struct StartFreedom {
  Eigen::MatrixXd position;  // joints x k
  Matrix6Xd displacement;    // 6 x k, of the base in B
};
/// Of the segment that `reach` describes, at a solution of it.
StartFreedom start_freedom(FloatingBase& base, const ReachProblem& reach, const ReachSolution& solution);

struct StraightWay {
  bool kept = false;
  StraightInPath path;     // exact, with the self-motion; empty where only the nodes were looked at (not kept)
  SelfMotion self_motion;  // empty where the rates of least norm do
  std::string trouble;     // if not kept: what is violated most, by how much and when
  double violation = 0;
  WayFigures figures;
  int self_motions = 0;       // how many independent ones there are, where there are most
  std::vector<double> start;  // joint values to begin with instead, if there is freedom to
  long rhs_evaluations = 0;
};

/// The piece with the least self-motion found that keeps what `kept` asks of its way (its limits, motion and way are
/// read), or the nearest to it. With `freedom` the piece may begin elsewhere, and StraightWay::start is all that is
/// said: where it would keep that, to first order in the freedom.
StraightWay keep_straight_in(FloatingBase& base, const StraightInProblem& problem, const ReachProblem& kept,
                             const StartFreedom* freedom = nullptr);

}  // namespace grapnel
