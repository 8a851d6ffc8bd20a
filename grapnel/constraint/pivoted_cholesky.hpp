#pragma once

/// @file
/// Cholesky factorization with pivoting of a possibly singular symmetric matrix: the independent rows, a solution that
/// uses these alone, and the residual of the others.

#include <span>
#include <vector>

namespace grapnel {

/// A = L D L^T on the rows chosen as pivots, largest remaining diagonal first (Higham, Analysis of the Cholesky
/// decomposition of a semi-definite matrix, 1990). No allocation after construction.
class PivotedCholesky {
 public:
  explicit PivotedCholesky(int size);

  int size() const { return size_; }
  /// The matrix to factor, row-major, both triangles; written by the caller before factor(), which does not change it.
  std::span<double> matrix() { return matrix_; }
  /// Factors until no remaining pivot exceeds `tolerance` times max(1, largest diagonal). NaN gives rank 0.
  void factor(double tolerance);

  int rank() const { return rank_; }
  /// The smallest accepted pivot; 0 with rank 0.
  double least_pivot() const { return least_pivot_; }
  /// Indices of rows, accepted ones first.
  std::span<const int> order() const { return order_; }

  /// Solves A x = b with x zero in the rows not taken. `residual` receives, per row, b - A x (exactly zero in rows
  /// taken).
  void solve(std::span<const double> b, std::span<double> x, std::span<double> residual);

  /// A vector x with A x = 0 up to the tolerance, one for each row not taken: k from 0 to size() - rank() - 1, with x =
  /// 1 in that row.
  void null_vector(int k, std::span<double> x) const;

 private:
  double lower(int row, int column) const { return factor_[static_cast<std::size_t>(row * size_ + column)]; }
  double& lower(int row, int column) { return factor_[static_cast<std::size_t>(row * size_ + column)]; }

  int size_;
  int rank_ = 0;
  double least_pivot_ = 0;
  std::vector<double> matrix_, factor_, diagonal_, forward_, pivot_row_, inverse_;
  std::vector<int> order_;
};

}  // namespace grapnel
