#pragma once

/// @file
/// Cholesky factorization with pivoting in packs, as constraint/pivoted_cholesky.hpp for one matrix. Each lane has its
/// own pivot order and rank. Rows are not exchanged, and every step updates the whole remaining matrix, so all lanes
/// execute the same operations. If lanes choose different rows, a column is blended from all rows; if they agree, it is
/// read directly. Both give the same bits.

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/spatial/pack.hpp"

namespace grapnel::lanes {

template <class S>
class LanePivots {
 public:
  using Mask = typename S::Mask;

  explicit LanePivots(int size)
      : size_(size),
        matrix_(size * size),
        lower_(size * size),
        diagonal_(size),
        in_order_inverse_(size),
        ordered_(size),
        column_(size),
        factor_(size * size),
        inverse_(size),
        forward_(size),
        choice_(size * size),
        agreed_(size),
        going_(size),
        taken_(size) {}

  /// The matrix to factor, of which the lower triangle (row >= column) is read; factor() overwrites it.
  S& at(int row, int column) { return matrix_[row * size_ + column]; }

  /// Factors the matrix. Each lane stops when no remaining pivot exceeds the rank tolerance times max(1, largest
  /// diagonal). NaN gives rank 0.
  void factor() {
    independent_ = factor_in_order();
    if (independent_ == Mask::kAllBits) {
      rank_ = S(static_cast<double>(size_));
      doubtful_ = 0;
      return;
    }
    factor_with_pivots();
    rank_ = select(Mask::from_bits(independent_), S(static_cast<double>(size_)), rank_);
    doubtful_ &= ~independent_;
  }

  /// Lanes in which a pivot of the last factorization was so close to the tolerance that rounding error may have
  /// decided.
  unsigned doubtful() const { return doubtful_; }
  /// All rows are independent in all lanes: solutions leave no residual.
  bool all_independent() const { return independent_ == Mask::kAllBits; }
  /// Number of independent rows.
  const S& rank() const { return rank_; }

  /// Solves A x = b with x zero in the rows not taken. `residual` (may be b) receives, per row, b - A x (exactly zero
  /// in rows taken).
  void solve(const S* b, S* x, S* residual) {
    if (independent_ != 0) solve_in_order(b, ordered_.data());
    if (independent_ == Mask::kAllBits) {
      for (int i = 0; i < size_; ++i) x[i] = ordered_[i], residual[i] = S(0.0);
      return;
    }
    solve_with_pivots(b, x, residual);
    if (independent_ == 0) return;
    const Mask in_order = Mask::from_bits(independent_);
    for (int i = 0; i < size_; ++i) {
      x[i] = select(in_order, ordered_[i], x[i]);
      residual[i] = select(in_order, S(0.0), residual[i]);
    }
  }

 private:
  // L D L^T in the original row order, for lanes with certain full rank. The last pivot is the determinant divided by
  // the other pivots, none of which exceeds its original diagonal entry. It is therefore at least the smallest diagonal
  // entry times the product of D divided by that of the diagonal.
  unsigned factor_in_order() {
    using namespace loop_limits;
    S largest(1.0), product(1.0), of_diagonal(1.0), least = at(0, 0);
    const S nothing(kRankTolerance);  // smaller values do not prove full rank
    unsigned independent = Mask::kAllBits;
    for (int j = 0; j < size_; ++j) {
      const S* row = lower_.data() + j * size_;
      const S& own = at(j, j);
      S d = own;
      for (int k = 0; k < j; ++k) {
        forward_[k] = diagonal_[k] * row[k];
        d -= forward_[k] * row[k];
      }
      independent &= (d > nothing).bits();
      if (independent == 0) return 0;
      largest = max(own, largest), least = min(own, least);
      product = product * d, of_diagonal = of_diagonal * own;
      diagonal_[j] = d;
      const S inverse = S(1.0) / d;
      in_order_inverse_[j] = inverse;
      for (int i = j + 1; i < size_; ++i) {
        S* below = lower_.data() + i * size_;
        S sum = at(i, j);
        for (int k = 0; k < j; ++k) sum -= below[k] * forward_[k];
        below[j] = sum * inverse;
      }
    }
    const S certain = S(kRankTolerance * kDoubtful) * largest;
    return independent & (S(product * least) > S(certain * of_diagonal)).bits();
  }

  void solve_in_order(const S* b, S* x) const {
    for (int i = 0; i < size_; ++i) {
      const S* row = lower_.data() + i * size_;
      S sum = b[i];
      for (int k = 0; k < i; ++k) sum -= row[k] * x[k];
      x[i] = sum;
    }
    for (int i = size_; i-- > 0;) {
      S sum = x[i] * in_order_inverse_[i];
      for (int k = i + 1; k < size_; ++k) sum -= lower_[k * size_ + i] * x[k];
      x[i] = sum;
    }
  }

  void factor_with_pivots() {
    using namespace loop_limits;
    S largest(1.0);
    for (int i = 0; i < size_; ++i) largest = max(at(i, i), largest), taken_[i] = 0;
    const S least = S(kRankTolerance) * largest;
    const S certain = S(kRankTolerance * kDoubtful) * largest, nothing = S(kRankTolerance / kDoubtful) * largest;
    unsigned going = Mask::kAllBits;
    rank_ = S(0.0);
    doubtful_ = 0;
    for (steps_ = 0; steps_ < size_; ++steps_) {
      const S pivot = choose(steps_);
      doubtful_ |= going & ((pivot > nothing) & (pivot < certain)).bits();
      going &= (pivot > least).bits();
      if (going == 0) return;
      const Mask go = Mask::from_bits(going);
      going_[steps_] = going;
      inverse_[steps_] = select(go, S(S(1.0) / pivot), S(0.0));
      rank_ += select(go, S(1.0), S(0.0));
      eliminate(steps_, going);
    }
  }

  void solve_with_pivots(const S* b, S* x, S* residual) {
    for (int i = 0; i < size_; ++i) residual[i] = b[i], x[i] = S(0.0);
    for (int s = 0; s < steps_; ++s) {
      const S own = chosen(s, residual);
      forward_[s] = own * inverse_[s];
      const S* L = factor_.data() + s * size_;
      for (int i = 0; i < size_; ++i) residual[i] -= L[i] * own;
      put(s, S(0.0), residual);
    }
    for (int s = steps_; s-- > 0;) {
      const S* L = factor_.data() + s * size_;
      S sum = forward_[s];
      for (int i = 0; i < size_; ++i) sum -= L[i] * x[i];
      put(s, sum, x);
    }
  }

  // Pivots within this factor of the tolerance are doubtful. Rounding error leaves about 1e-15 in redundant rows.
  static constexpr double kDoubtful = 30;

  const S& symmetric(int i, int j) const { return matrix_[i >= j ? i * size_ + j : j * size_ + i]; }

  // Step s chooses the largest remaining diagonal entry of every lane, the first among equal ones.
  S choose(int s) {
    unsigned* choice = choice_.data() + s * size_;
    S best(-1.0);
    for (int i = 0; i < size_; ++i) column_[i] = select(Mask::from_bits(taken_[i]), S(-1.0), at(i, i));
    for (int i = 0; i < size_; ++i) best = max(column_[i], best);
    unsigned open = Mask::kAllBits;
    agreed_[s] = -1;
    for (int i = 0; i < size_; ++i) {
      choice[i] = open & (column_[i] == best).bits();
      open &= ~choice[i];
      if (choice[i] == Mask::kAllBits) agreed_[s] = i;
    }
    return best;
  }

  // Entry of a vector in the chosen rows.
  S chosen(int s, const S* x) const {
    if (agreed_[s] >= 0) return x[agreed_[s]];
    S value = x[0];
    for (int i = 1; i < size_; ++i) value = select(Mask::from_bits(choice_[s * size_ + i]), x[i], value);
    return value;
  }
  // Writes the entry in lanes that have chosen the row.
  void put(int s, const S& value, S* x) const {
    for (int i = 0; i < size_; ++i) {
      const unsigned lanes = choice_[s * size_ + i] & going_[s];
      if (lanes != 0) x[i] = select(Mask::from_bits(lanes), value, x[i]);
    }
  }

  // Eliminates the chosen rows from the remaining matrix: A - l d l^T.
  void eliminate(int s, unsigned going) {
    S* L = factor_.data() + s * size_;
    const unsigned* choice = choice_.data() + s * size_;
    for (int i = 0; i < size_; ++i) {
      if (agreed_[s] >= 0) {
        column_[i] = symmetric(i, agreed_[s]);
      } else {
        S value = symmetric(i, 0);
        for (int p = 1; p < size_; ++p) value = select(Mask::from_bits(choice[p]), symmetric(i, p), value);
        column_[i] = value;
      }
      taken_[i] |= choice[i] & going;
      if (taken_[i] != 0) column_[i] = select(Mask::from_bits(taken_[i]), S(0.0), column_[i]);
      L[i] = column_[i] * inverse_[s];
    }
    for (int i = 0; i < size_; ++i) {
      if (taken_[i] == Mask::kAllBits) continue;
      for (int j = 0; j <= i; ++j) at(i, j) -= column_[i] * L[j];
    }
  }

  int size_;
  int steps_ = 0;
  unsigned doubtful_ = 0;
  unsigned independent_ = 0;  // lanes factored in the original row order
  S rank_ = S(0.0);
  LaneArray<S> matrix_;
  LaneArray<S> lower_, diagonal_, in_order_inverse_;  // for the original row order: L, D and D^-1
  LaneArray<S> ordered_;                              // a solution in that order
  LaneArray<S> column_;
  LaneArray<S> factor_;             // per step: a column of L without its unit entry, zero in rows taken before
  LaneArray<S> inverse_, forward_;  // per step; inverse_ is zero in lanes that have reached their rank
  LaneArray<S, unsigned> choice_;   // per step and row: lanes that take it
  LaneArray<S, int> agreed_;        // per step: the row chosen by all lanes; -1: lanes disagree
  LaneArray<S, unsigned> going_;    // per step: lanes that have not reached their rank
  LaneArray<S, unsigned> taken_;    // per row
};

}  // namespace grapnel::lanes
