#pragma once

/// @file
/// Cholesky factorization with pivoting of a symmetric matrix that may be singular: which rows are independent, a
/// solution that uses these alone, and what the others do not agree with.

#include <span>
#include <vector>

namespace grapnel {

/// A = L D L^T on the rows chosen as pivots, largest remaining diagonal first (Higham, Analysis of the Cholesky
/// decomposition of a semi-definite matrix, 1990). Nothing allocates after construction.
class PivotedCholesky {
 public:
  explicit PivotedCholesky(int size);

  int size() const { return size_; }
  /// The matrix to factor, row-major, both triangles; the caller fills it before factor(), which leaves it alone.
  std::span<double> matrix() { return matrix_; }
  /// Factors, and stops where no remaining pivot exceeds `tolerance` times max(1, largest diagonal). NaN leaves rank 0.
  void factor(double tolerance);

  int rank() const { return rank_; }
  /// The least pivot taken; 0 with rank 0.
  double least_pivot() const { return least_pivot_; }
  /// Indices of rows, those taken first.
  std::span<const int> order() const { return order_; }

  /// Solves A x = b with x zero in the rows not taken. `residual` receives, per row, what A x leaves of b there
  /// (exactly zero in rows taken).
  void solve(std::span<const double> b, std::span<double> x, std::span<double> residual);

  /// A vector x with A x = 0, as far as rows not taken are zero against those taken: one for each of these rows, k from
  /// 0 to size() - rank() - 1, where x is 1.
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
