#include "grapnel/constraint/pivoted_cholesky.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace grapnel {

PivotedCholesky::PivotedCholesky(int size)
    : size_(size),
      matrix_(static_cast<std::size_t>(size * size)),
      factor_(matrix_.size()),
      diagonal_(static_cast<std::size_t>(size)),
      forward_(static_cast<std::size_t>(size)),
      pivot_row_(static_cast<std::size_t>(size)),
      inverse_(static_cast<std::size_t>(size)),
      order_(static_cast<std::size_t>(size)) {}

// Matrix => L, D and pivot order, with the largest remaining diagonal as pivot; stops below the tolerance.
void PivotedCholesky::factor(double tolerance) {
  std::iota(order_.begin(), order_.end(), 0);
  rank_ = 0;
  min_pivot_ = 0;
  double largest = 1;
  for (int i = 0; i < size_; ++i) {
    diagonal_[i] = matrix_[i * size_ + i];
    largest = std::max(largest, diagonal_[i]);
  }
  for (int step = 0; step < size_; ++step) {
    int best = step;
    for (int k = step + 1; k < size_; ++k) {
      if (diagonal_[order_[k]] > diagonal_[order_[best]]) best = k;
    }
    const double pivot = diagonal_[order_[best]];
    if (!(pivot > tolerance * largest)) return;
    std::swap(order_[step], order_[best]);
    const int p = order_[step];
    const double inverse = inverse_[step] = 1 / pivot;
    for (int j = 0; j < step; ++j) pivot_row_[j] = lower(p, j) * diagonal_[order_[j]];
    for (int k = step + 1; k < size_; ++k) {
      const int i = order_[k];
      double sum = matrix_[i * size_ + p];  // L_ip times the pivot
      for (int j = 0; j < step; ++j) sum -= lower(i, j) * pivot_row_[j];
      lower(i, step) = sum * inverse;
      diagonal_[i] -= sum * lower(i, step);
    }
    min_pivot_ = pivot;
    ++rank_;
  }
}

// b => x on the accepted rows by forward and backward substitution, and the residual b - A x of the other rows.
void PivotedCholesky::solve(std::span<const double> b, std::span<double> x, std::span<double> residual) {
  for (int step = 0; step < rank_; ++step) {
    const int p = order_[step];
    double sum = b[p];
    for (int j = 0; j < step; ++j) sum -= lower(p, j) * forward_[j];
    forward_[step] = sum;
    residual[p] = 0;
  }
  for (int k = rank_; k < size_; ++k) {
    const int i = order_[k];
    double sum = b[i];
    for (int j = 0; j < rank_; ++j) sum -= lower(i, j) * forward_[j];
    residual[i] = sum;
    x[i] = 0;
  }
  for (int step = rank_; step-- > 0;) {
    const int p = order_[step];
    double sum = forward_[step] * inverse_[step];
    for (int k = step + 1; k < rank_; ++k) sum -= lower(order_[k], step) * x[order_[k]];
    x[p] = sum;
  }
}

// With pivot rows P, A_PP = L D L^T, and A_Pd = L D l for another row d, with l its row of the factor: A_PP x_P = -A_Pd
// is equivalent to L^T x_P = -l.
void PivotedCholesky::null_vector(int k, std::span<double> x) const {
  const int d = order_[rank_ + k];
  std::fill(x.begin(), x.end(), 0.0);
  x[d] = 1;
  for (int step = rank_; step-- > 0;) {
    double sum = -lower(d, step);
    for (int later = step + 1; later < rank_; ++later) sum -= lower(order_[later], step) * x[order_[later]];
    x[order_[step]] = sum;
  }
}

}  // namespace grapnel
