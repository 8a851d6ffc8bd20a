#pragma once

/// @file
/// Of all impulses that redundant rows allow, the one with the least P^T D P (docs/theory.md, equation (7.8)), from a
/// pivoted factor of W.

#include "grapnel/constraint/loop_path.hpp"
#include "grapnel/constraint/pivoted_cholesky.hpp"

namespace grapnel {

/// With a basis N of self-stresses, N^T D N z = -N^T D P and P + N z. Nothing allocates after construction.
class LeastImpulse {
 public:
  /// For so many rows.
  explicit LeastImpulse(int rows);

  /// Changes `P`, physical impulses per row, by a self-stress of `factor`, whose W is in the rows' units
  /// (LoopPath::scale). `targets[k]` is body b of paths[k].
  void choose(const PivotedCholesky& factor, std::span<const LoopPath> paths, std::span<const LoopPlace> places,
              std::span<const LoneBody> targets, std::span<double> P);

 private:
  double& at(std::vector<double>& matrix, int row, int column) {
    return matrix[static_cast<std::size_t>(row * rows_ + column)];
  }
  void multiply_by_metric(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
                          std::span<const LoneBody> targets, std::span<const double> x,
                          std::span<double> product) const;

  int rows_;
  std::vector<double> self_stress_, weighted_;  // N^T and (D N)^T, row-major, as many rows of them as are needed
  std::vector<double> scaled_, right_, z_, ignored_;
  PivotedCholesky small_;
};

}  // namespace grapnel
