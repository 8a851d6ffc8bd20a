#pragma once

/// @file
/// Sequential quadratic programming for plans:
///   min f(y)   with   e(y) = 0   and   g_i(y) <= 0 for every i of a set that may be infinite                       (1)
/// e may have dependent components. At an iterate the g_i that are nearly violated are made linear, and a step d solves
///   min d^T B d / 2 + d^T grad f   with   e + J d = 0,   g_i + a_i^T d <= 0                                        (2)
/// B being an estimate of the Hessian of the Lagrangian, positive definite, learned from step to step (BFGS's formula,
/// damped [Powell 1978; Nocedal and Wright 2006, 18.3]). With B + nu 1 = L L^T and x = L^T d this is the point nearest
/// to -L^-1 grad f that keeps linear equations and inequalities, a least-distance program (least_distance.hpp) in the
/// null space of J L^-T. Its rows give way, all alike, where they cannot all be kept.
///
/// Steps are no longer than a radius, within which (2) has been seen to foresee what happens: nu damps what the
/// objective asks for until d is no longer, and what e and the g_i ask for beyond that is done in part. A step is taken
/// where
///   f + mu max(0, g_i over all i, |e_k|)                                                                           (3)
/// becomes less by it, so that what (2) knows nothing of counts too. Where a whole step does not do, it is corrected
/// for the curvature of the g_i and e [Nocedal and Wright 2006, 18.11]; where something was in its way that (2) knew
/// nothing of, (2) is solved with that as well; then the radius becomes less. A step costs the unknowns' number cubed
/// over three, for L, and its square for each row that is active; programs begin with the rows that held the step
/// before.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace grapnel {

/// What is linear at an iterate. Where f holds -w min_i d_i, w > 0, there is one unknown more, the last one, z with
/// -w z in its place and rows z - d_i <= 0, z beginning as the least d_i.
struct Linearized {
  Eigen::VectorXd slope;     // grad f; -w for z
  Eigen::VectorXd error;     // e
  Eigen::MatrixXd J;         // its derivatives, with zeros for z
  std::vector<long> rows;    // which g_i follow: the same number for the same i at every iterate
  Eigen::VectorXd violated;  // g_i
  Eigen::MatrixXd A;         // a_i^T, 1 for z in its rows
  double out_of_reach = 0;   // the most of the g_i that were left out since no step makes them less
};

/// (1), as one who solves it looks at it from place to place.
class NonlinearProgram {
 public:
  virtual ~NonlinearProgram() = default;
  /// Goes to y. False where nothing can be said there.
  virtual bool go_to(const std::vector<double>& y) = 0;
  /// f, there.
  virtual double value() = 0;
  /// The most of all g_i and |e_k| there; z's rows are none of them.
  virtual double violation() = 0;
  virtual Linearized linearized() = 0;
  /// Whether there is more to be made linear than there was at the last linearized(), seen since.
  virtual bool has_more() = 0;
  /// e and some of the g_i there. z is what it was at the last linearized().
  virtual void look(std::span<const long> rows, Eigen::VectorXd& error, Eigen::VectorXd& violated) = 0;
  /// What B is to begin with, without z.
  virtual Eigen::MatrixXd curvature() = 0;
};

struct QuadraticSearch {
  double farthest = 0.5;   // that an unknown moves in a step
  double nothing = 1e-7;   // a step that moves none farther ends the search
  double settled = 1e-9;   // steps that make f less by no more than this share of it end it too
  double violated = 5e-7;  // no more than this is violated in the end
  int most = 150;          // steps
};

/// From y, where the program is, to a minimum of (1) near there: the program stays at the best iterate, and y is that.
/// Unknowns that are not `free` stay. `B` is what was learned: of no size, it begins with the program's curvature.
/// Returns how many steps it took.
int minimize(NonlinearProgram& program, const std::vector<int>& free, const QuadraticSearch& search,
             std::vector<double>& y, Eigen::MatrixXd& B);

}  // namespace grapnel
