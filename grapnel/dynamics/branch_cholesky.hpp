#pragma once

/// @file
/// The mass matrix factored along the branches of the tree: M = L^T L, in which L has the zeros of M that bodies on
/// different branches leave. [Featherstone 2008, section 6.5]

#include <Eigen/Core>
#include <vector>

#include "grapnel/model/model.hpp"

namespace grapnel {

/// Rows of right sides, as many columns as there are solutions.
using RightSides = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Allocates when it is made. Thread safety: one thread at a time.
class BranchCholesky {
 public:
  explicit BranchCholesky(const Model& model);

  /// M has the zeros of the model's mass matrix; only what is on and below its diagonal is read.
  void factor(const Eigen::MatrixXd& M);
  /// M^-1 X in place.
  void solve(RightSides& X) const;

 private:
  std::vector<int> order_;                    // velocities, from the roots out
  std::vector<std::vector<int>> supporting_;  // per velocity: those nearer to the root that carry it, nearest first
  RightSides L_;                              // row of a velocity, columns of those that carry it; inverse diagonal
};

}  // namespace grapnel
