#pragma once

/// @file
/// The mass matrix factored along the branches of the tree: M = L^T L, in which L has the zeros of M that bodies on
/// different branches leave. [Featherstone 2008, section 6.5]

#include <Eigen/Core>
#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// Thread safety: one thread at a time.
class BranchCholesky {
 public:
  explicit BranchCholesky(const Model& model);

  /// M has the zeros of the model's mass matrix; only what is on and below its diagonal is read.
  void factor(const Eigen::MatrixXd& M);
  /// X = M^-1 B, of one size with B.
  void solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X);

 private:
  std::size_t rows() const { return order_.size(); }

  std::vector<int> order_;          // velocities, from the roots out
  std::vector<std::size_t> begin_;  // of a velocity's row in the two below
  std::vector<int> on_;             // velocities nearer to the root that carry it, nearest first
  std::vector<double> L_;           // their columns
  std::vector<double> inverse_;     // of the diagonal
  std::vector<double> X_;           // row by row, padded
};

}  // namespace grapnel
