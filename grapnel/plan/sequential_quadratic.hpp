#pragma once

/// @file
/// Sequential quadratic programming for plans:
///   min f(y)   with   e(y) = 0   and   g_i(y) <= 0 for every i of a set that may be infinite                       (1)
/// e may have dependent components. At an iterate the nearly violated g_i are linearized, and a step d solves
///   min d^T B d / 2 + d^T grad f   with   e + J d = 0,   g_i + a_i^T d <= 0                                        (2)
/// B is a positive definite estimate of the Hessian of the Lagrangian, updated at each step by the damped BFGS formula
/// [Powell 1978; Nocedal and Wright 2006, 18.3]. With B + nu 1 = L L^T and x = L^T d, (2) asks for the point closest to
/// -L^-1 grad f that satisfies linear equations and inequalities: a least-distance program (least_distance.hpp) in the
/// null space of J L^-T. If its rows are infeasible together, all are relaxed equally.
///
/// A trust radius bounds the steps: nu damps the objective's part of d to the radius, and the part due to e and the g_i
/// is shortened to it. A step is accepted if it decreases the merit function
///   f + mu max(0, g_i over all i, |e_k|)                                                                           (3)
/// which also contains constraints missing from (2). A rejected step is first corrected for the curvature of the g_i
/// and e [Nocedal and Wright 2006, 18.11]. If constraints missing from (2) caused the rejection, (2) is solved again
/// with them; then the radius is reduced. With n unknowns a step costs n^3/3 for L and n^2 per active row. Each program
/// starts with the active rows of the previous step.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace grapnel {

/// Linearization at an iterate. If f contains -w min_i d_i, w > 0, there is one more unknown, the last one, z, with -w
/// z in its place and rows z - d_i <= 0. The initial value of z is the minimum of d_i.
struct Linearized {
  Eigen::VectorXd slope;     // grad f; -w for z
  Eigen::VectorXd error;     // e
  Eigen::MatrixXd J;         // Jacobian of e, with zeros for z
  std::vector<long> rows;    // identifiers of the following g_i, constant over the iterates
  Eigen::VectorXd violated;  // g_i
  Eigen::MatrixXd A;         // a_i^T, 1 for z in its rows
  double out_of_reach = 0;   // largest of the g_i omitted because no step decreases them
};

/// Interface of (1) to the solver: evaluation at successive points.
class NonlinearProgram {
 public:
  virtual ~NonlinearProgram() = default;
  /// Moves to y. False if it cannot be evaluated.
  virtual bool move_to(const std::vector<double>& y) = 0;
  /// f at the present point.
  virtual double value() = 0;
  /// The largest of all g_i and |e_k| at the present point, excluding the rows of z.
  virtual double violation() = 0;
  virtual Linearized linearized() = 0;
  /// Whether constraints that were not part of the last linearized() have been found since.
  virtual bool has_more() = 0;
  /// e and the given g_i at the present point. z has its value at the last linearized().
  virtual void evaluate(std::span<const long> rows, Eigen::VectorXd& error, Eigen::VectorXd& violated) = 0;
  /// Initial value of B, without z.
  virtual Eigen::MatrixXd curvature() = 0;
};

struct QuadraticSearch {
  double farthest = 0.5;   // maximum change of an unknown in a step
  double nothing = 1e-7;   // the search ends at steps that change no unknown by more
  double settled = 1e-9;   // the search ends at steps that decrease f by at most this share of it
  double violated = 5e-7;  // maximum violation of the result
  int max_steps = 150;     // maximum number of steps
};

/// Minimizes (1) locally from y, the present point of the program. On return the program is at the best iterate, and y
/// is that point. Unknowns that are not `free` are fixed. `B`: in and out, the estimate of the Hessian; empty: the
/// program's curvature. Returns the number of steps.
int minimize(NonlinearProgram& program, const std::vector<int>& free, const QuadraticSearch& search,
             std::vector<double>& y, Eigen::MatrixXd& B);

}  // namespace grapnel
