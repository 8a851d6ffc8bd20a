#pragma once

/// @file
/// Branch-induced Cholesky factorization of the mass matrix: M = L^T L, where L has the zeros of M that result from
/// bodies on different branches. [Featherstone 2008, section 6.5]

#include <Eigen/Core>
#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// Thread safety: one thread at a time.
class BranchCholesky {
 public:
  explicit BranchCholesky(const Model& model);

  /// M has the zeros of the model's mass matrix; only its lower triangle is read.
  void factor(const Eigen::MatrixXd& M);
  /// X = M^-1 B, with the size of B.
  void solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X);

 private:
  std::size_t rows() const { return order_.size(); }

  std::vector<int> order_;          // velocities, from the roots outwards
  std::vector<std::size_t> begin_;  // offset of a velocity's row in on_ and L_
  std::vector<int> on_;             // velocities between it and the root, nearest first
  std::vector<double> L_;           // the corresponding entries of L
  std::vector<double> inverse_;     // of the diagonal
  std::vector<double> X_;           // row by row, padded
};

}  // namespace grapnel
