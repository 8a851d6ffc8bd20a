#pragma once

/// @file
/// Gauss–Legendre collocation: nodes and weights of Gauss quadrature on [0, 1], and the coefficients of the implicit
/// Runge–Kutta method of order 2 m with m stages (Hairer, Lubich and Wanner, Geometric Numerical Integration, II.1.2).
/// The method conserves quadratic invariants, so quaternions keep their norm.
///
/// With P_k the Legendre polynomials on [-1, 1] and x = 2 c - 1, the polynomial that passes through values f_j at the
/// nodes is sum_k f^_k P_k with
///   f^_k = (2 k + 1)/2 sum_j w_j P_k(x_j) f_j,   w_j the weights on [-1, 1]                                        (1)
/// and with the integral of P_k from -1, (P_{k+1} - P_{k-1})/(2 k + 1) (x + 1 for k = 0),
///   a_ij = integral_0^{c_i} l_j(c) dc = w_j/4 [x_i + 1 + sum_{k=1}^{m-1} P_k(x_j) (P_{k+1}(x_i) - P_{k-1}(x_i))].  (2)

#include <vector>

namespace grapnel {

class GaussLegendre {
 public:
  /// @throws std::invalid_argument unless there are at least two stages.
  explicit GaussLegendre(int stages);

  int stages() const { return static_cast<int>(node_.size()); }
  /// Node i in ]0, 1[, increasing with i.
  double node(int i) const { return node_[i]; }
  double weight(int i) const { return weight_[i]; }
  /// a_ij of (2).
  double a(int i, int j) const { return a_[static_cast<std::size_t>(i) * node_.size() + static_cast<std::size_t>(j)]; }
  /// f^_k = sum_j last(j) f_j for k = m - 1, and likewise for k = m - 2: indicators of how well the nodes resolve f.
  double last(int j) const { return last_[j]; }
  double last_but_one(int j) const { return last_but_one_[j]; }

 private:
  std::vector<double> node_, weight_, a_, last_, last_but_one_;
};

}  // namespace grapnel
