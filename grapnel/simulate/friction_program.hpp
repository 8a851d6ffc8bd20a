#pragma once

/// @file
/// The small convex programs of joints at rest (docs/theory, section 19): which of them slip, whether friction can
/// hold all, and which of several admissible sets of friction efforts is reported. Thread safety: free functions.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// min 1/2 x^T A x + b^T x with lower <= x <= upper, A symmetric positive semidefinite; bounds may be infinite, and 0
/// lies between them. The gradient A x + b is unique, x is not where A is singular.
struct BoxProgram {
  Eigen::MatrixXd A;  // diagonal entries of order 1 or less
  Eigen::VectorXd b, lower, upper;
  Eigen::VectorXd tolerance;  // components of the gradient up to this are rounding errors
};

struct BoxSolution {
  Eigen::VectorXd x;
  Eigen::VectorXd gradient;
  std::vector<int> bound;  // -1: at the lower bound, 1: at the upper one, 0: between them
  bool bounded = true;     // false: the objective is unbounded along an infinite bound
};

/// By the primal active-set method with Newton steps on the free variables, from x = 0.
BoxSolution minimize_in_box(const BoxProgram& program);

/// The efforts x0 + N z for any z, N with orthonormal columns, scaled so that excesses over the bounds are comparable.
struct EffortFamily {
  Eigen::VectorXd x0;
  Eigen::MatrixXd N;
  Eigen::VectorXd lower, upper;  // may be infinite, at most one of each pair
  Eigen::VectorXd weight;        // units of the excess, positive
};

struct LeastExcess {
  double excess;  // min over z of the max over i of (lower - x)_i / weight_i and (x - upper)_i / weight_i; at least -1
  Eigen::VectorXd x;  // one minimizer
};

/// By the simplex method on the dual program, with Bland's rule.
LeastExcess least_excess(const EffortFamily& family);

/// The minimum-norm member of the family within the bounds. `feasible`: any member within them. By nonnegative least
/// squares (Lawson and Hanson 1974, chapter 23).
Eigen::VectorXd least_norm_within(const EffortFamily& family, const Eigen::VectorXd& feasible);

/// An orthonormal basis of the span of `directions`; entries below the rounding error of `terms`, the magnitudes of the
/// summands of each entry, count as zero. No columns: the span is zero.
Eigen::MatrixXd basis_of(Eigen::MatrixXd directions, const Eigen::MatrixXd& terms);

}  // namespace grapnel
