#pragma once

/// @file
/// The factorization of a tree's mass matrix, for the solution with many right-hand sides.

#include <cstddef>
#include <vector>

#include "grapnel/dynamics/packed_rows.hpp"

namespace grapnel::packed_rows {

// L and D of M = L^T D L with the zeros of M of a tree, and the solution for many right-hand sides: as BranchCholesky,
// with right-hand sides in padded rows.
class RowCholesky {
 public:
  // `on`: for each velocity those between the root and it, from the root outwards.
  explicit RowCholesky(const std::vector<std::vector<int>>& on)
      : inverse_(on.size()), beyond_begin_{0}, begin_{0}, L_(padded_entries(on)) {
    std::vector<std::vector<Beyond>> beyond(on.size());
    for (std::size_t i = 0; i < on.size(); ++i) {
      for (const int a : on[i]) {
        beyond[static_cast<std::size_t>(a)].push_back({static_cast<int>(i), static_cast<int>(on_.size())});
        on_.push_back(a);
      }
      end_.push_back(static_cast<int>(on_.size()));
      on_.resize((on_.size() + 2 * kPack - 1) / kPack * kPack);
      begin_.push_back(static_cast<int>(on_.size()));
    }
    for (const std::vector<Beyond>& list : beyond) {
      beyond_.insert(beyond_.end(), list.begin(), list.end());
      beyond_begin_.push_back(static_cast<int>(beyond_.size()));
    }
    transposed_.resize(beyond_.size());
  }
  int size() const { return static_cast<int>(inverse_.size()); }

  // Reads M(i, a) for a = i and the velocities between i and the root.
  void factor(const double* M, int stride) {
    for (int i = 0; i < size(); ++i) {
      inverse_[i] = M[i * stride + i];
      for (int e = begin_[i]; e < begin_[i + 1]; ++e) L_.data()[e] = e < end_[i] ? M[i * stride + on_[e]] : 0;
    }
    for (int k = size(); k-- > 0;) {
      const double inverse = inverse_[k] = 1 / inverse_[k];
      const int count = end_[k] - begin_[k];
      double* const row = L_.data() + begin_[k];
      // The row of the a-th velocity from the root has the first a velocities of this row. What follows it is not used.
      for (int a = 0; a < count; ++a) {
        const int i = on_[begin_[k] + a];
        const double share = inverse * row[a];
        inverse_[i] -= share * row[a];
        double* const to = L_.data() + begin_[i];
        for (int b = 0; b < a; b += kPack) pack_at(to + b) -= share * pack_at(row + b);
      }
      for (int b = 0; b < count; b += kPack) pack_at(row + b) *= inverse;
    }
    for (std::size_t e = 0; e < beyond_.size(); ++e) transposed_[e] = L_.data()[beyond_[e].entry];
  }

  // x <- M^-1 x. By columns, then by rows in two sums: a chain of products would take their latency each.
  void solve(double* x) const {
    for (int k = size(); k-- > 0;) {
      const double y = x[k];
      for (int e = begin_[k]; e < end_[k]; ++e) x[on_[e]] -= L_.data()[e] * y;
    }
    for (int i = 0; i < size(); ++i) {
      double sum = inverse_[i] * x[i], other = 0;
      int e = begin_[i];
      for (; e + 1 < end_[i]; e += 2) sum -= L_.data()[e] * x[on_[e]], other -= L_.data()[e + 1] * x[on_[e + 1]];
      if (e < end_[i]) sum -= L_.data()[e] * x[on_[e]];
      x[i] = sum + other;
    }
  }

  // The same for the columns of rows X: L^T Y = X, D Z = Y, L X = Z.
  void solve(double* X, int stride, int columns) const {
    int at = 0;
#ifdef __AVX512F__  // with fewer registers eight sums would be in memory
    for (; at + 5 * kPack < columns; at += 8 * kPack) {
      if (at + 6 * kPack >= columns) {
        solve_packs<6>(X + at, stride);
      } else {
        solve_packs<8>(X + at, stride);
      }
    }
#endif
    for (; at + 3 * kPack < columns; at += 4 * kPack) solve_packs<4>(X + at, stride);
    if (at + kPack < columns) solve_packs<2>(X + at, stride), at += 2 * kPack;
    if (at < columns) solve_packs<1>(X + at, stride);
  }

 private:
  struct Beyond {
    int velocity, entry;  // a velocity that this one carries; the entry of L that ties them
  };

  // Each row begins at a cache line and fills packs.
  static int padded_entries(const std::vector<std::vector<int>>& on) {
    std::size_t count = 0;
    for (const std::vector<int>& list : on) count += list.size() + 2 * kPack;
    return static_cast<int>(count);
  }

  template <int kCount>
  void solve_packs(double* X, int stride) const {
    for (int i = size(); i-- > 0;) {
      Pack sum[kCount];
      double* const row = X + i * stride;
      for (int k = 0; k < kCount; ++k) sum[k] = pack_at(row + k * kPack);
      for (int e = beyond_begin_[i]; e < beyond_begin_[i + 1]; ++e) {
        const double* const from = X + beyond_[e].velocity * stride;
        for (int k = 0; k < kCount; ++k) sum[k] -= transposed_[e] * pack_at(from + k * kPack);
      }
      for (int k = 0; k < kCount; ++k) pack_at(row + k * kPack) = sum[k];
    }
    for (int i = 0; i < size(); ++i) {
      Pack sum[kCount];
      double* const row = X + i * stride;
      for (int k = 0; k < kCount; ++k) sum[k] = inverse_[i] * pack_at(row + k * kPack);
      for (int e = begin_[i]; e < end_[i]; ++e) {
        const double* const from = X + on_[e] * stride;
        for (int k = 0; k < kCount; ++k) sum[k] -= L_.data()[e] * pack_at(from + k * kPack);
      }
      for (int k = 0; k < kCount; ++k) pack_at(row + k * kPack) = sum[k];
    }
  }

  std::vector<double> inverse_;  // of D
  std::vector<int> beyond_begin_, begin_, end_, on_;
  std::vector<Beyond> beyond_;
  PackedNumbers L_;                 // in the order of on_
  std::vector<double> transposed_;  // in that of beyond_
};

}  // namespace grapnel::packed_rows
