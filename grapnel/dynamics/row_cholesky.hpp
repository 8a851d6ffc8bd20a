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
      beyond_.insert(beyond_.end(), list.rbegin(), list.rend());
      beyond_begin_.push_back(static_cast<int>(beyond_.size()));
    }
    places_.resize(on_.size());
    for (std::size_t e = 0; e < beyond_.size(); ++e)
      places_[static_cast<std::size_t>(beyond_[e].entry)] = static_cast<int>(e);
    transposed_.resize(beyond_.size());
    weighted_.resize(beyond_.size());
  }
  int size() const { return static_cast<int>(inverse_.size()); }

  // Reads M(i, a) for a = i and the velocities between i and the root. Row i is the sum of its row of M and of the rows
  // beyond it, of which it is a part: in registers, stored once. The row that was computed last is added last.
  void factor(const double* M, int stride) {
    for (int i = 0; i < size(); ++i) {
      for (int e = begin_[i]; e < begin_[i + 1]; ++e) L_.data()[e] = e < end_[i] ? M[i * stride + on_[e]] : 0;
      L_.data()[end_[i]] = M[i * stride + i];
    }
    for (int i = size(); i-- > 0;) {
      const int packs = (end_[i] - begin_[i]) / kPack + 1;
      int at = 0;
      for (; at + 4 <= packs; at += 4) sum_row<4>(i, at * kPack);
      if (at + 2 <= packs) sum_row<2>(i, at * kPack), at += 2;
      if (at < packs) sum_row<1>(i, at * kPack);
      scale_row(i, packs);
    }
  }

  // x <- M^-1 x. Of every sum the latest term comes last.
  void solve(double* x) const {
    for (int i = size(); i-- > 0;) {
      double sum = x[i];
      for (int e = beyond_begin_[i]; e < beyond_begin_[i + 1]; ++e) sum -= transposed_[e] * x[beyond_[e].velocity];
      x[i] = sum;
    }
    for (int i = 0; i < size(); ++i) {
      double sum = inverse_[i] * x[i];
      for (int e = begin_[i]; e < end_[i]; ++e) sum -= L_.data()[e] * x[on_[e]];
      x[i] = sum;
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

  // kCount packs of row i from entry `at` on: M - sum of D_k L_ki L_k over the velocities k beyond i.
  template <int kCount>
  GRAPNEL_INLINE void sum_row(int i, int at) {
    double* const row = L_.data() + begin_[i] + at;
    Pack sum[kCount];
    for (int c = 0; c < kCount; ++c) sum[c] = pack_at(row + c * kPack);
    for (int e = beyond_begin_[i]; e < beyond_begin_[i + 1]; ++e) {
      const double* const from = L_.data() + begin_[beyond_[e].velocity] + at;
      for (int c = 0; c < kCount; ++c) sum[c] -= weighted_[e] * pack_at(from + c * kPack);
    }
    for (int c = 0; c < kCount; ++c) pack_at(row + c * kPack) = sum[c];
  }

  // Row i of D L => D and L. Entries of column i of L are those that the sums of the ancestors need.
  GRAPNEL_INLINE void scale_row(int i, int packs) {
    double* const row = L_.data() + begin_[i];
    const double inverse = inverse_[i] = 1 / row[end_[i] - begin_[i]];
    for (int e = begin_[i]; e < end_[i]; ++e) {
      weighted_[places_[e]] = L_.data()[e], transposed_[places_[e]] = inverse * L_.data()[e];
    }
    for (int c = 0; c < packs; ++c) pack_at(row + c * kPack) *= inverse;
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
  PackedNumbers L_;          // in the order of on_
  std::vector<int> places_;  // of each entry of L_ in beyond_
  // In the order of beyond_: L and D L.
  std::vector<double> transposed_, weighted_;
};

}  // namespace grapnel::packed_rows
