#pragma once

/// @file
/// The equations of the inner time of contact_path.hpp, (11.3) to (11.8), and one step of DOP853, for any scalar:
/// doubles, or packs with a different path in each lane. contact_path_motion.cpp instantiates them for doubles; the
/// translation units contact_path_packs_SET.cpp for packs.

#include <cmath>

#include "grapnel/impact/contact_path_steps.hpp"
#include "grapnel/integrate/dormand_prince_853_kernel.hpp"

namespace grapnel {
namespace contact_path_kernel {

// Counterparts for doubles of the functions for packs in grapnel/spatial/pack.hpp.
GRAPNEL_INLINE double select(bool condition, double a, double b) { return condition ? a : b; }
GRAPNEL_INLINE bool any(bool condition) { return condition; }
GRAPNEL_INLINE double max(double a, double b) { return a > b ? a : b; }
GRAPNEL_INLINE double abs(double a) { return __builtin_fabs(a); }

template <class S>
inline constexpr int kWidth = S::kWidth;
template <>
inline constexpr int kWidth<double> = 1;

}  // namespace contact_path_kernel

/// Velocities u at y = [f; P; ...], and the rates of y. `table`: of PathTable. Terms that no lane needs are skipped; in
/// a lane that does not need them they would change no bit. `N`: number of contacts for a specialized implementation;
/// 0: any number.
template <int N, class S>
void path_rates(const PathTable& table_of, const S* table, bool any_sticks, const S* y, S* u, S* b, S* rate) {
  using namespace contact_path_kernel;
  using std::sqrt;
  const PathTable at{N > 0 ? N : table_of.n};
  const int n = at.n, rows = 3 * n;
  const S *const W = table + at.mobility(), *const P = y + n;
  S* const force = rate + n;
  for (int r = 0; r < rows; ++r) {
    S sum = table[at.before() + r];
    for (int c = 0; c < rows; ++c) sum += W[r * rows + c] * P[c];
    u[r] = sum;
  }
  for (int i = 0; i < n; ++i) {
    const S* const spring = table + at.spring(i);
    const S radius = spring[PathTable::friction] * y[i], slow = spring[PathTable::slow];
    S x = spring[PathTable::along], z = spring[PathTable::along + 1];
    if (any(slow < S(kFrictionless))) {
      const S s_x = u[3 * i + 1] - spring[PathTable::offset], s_z = u[3 * i + 2] - spring[PathTable::offset + 1];
      const S speed = sqrt(S(s_x * s_x + s_z * s_z));
      const S reciprocal = S(1.0) / max(speed, S(1e-300));
      const auto moves = slow < speed;
      x = select(moves, S(s_x * reciprocal), x), z = select(moves, S(s_z * reciprocal), z);
    }
    force[3 * i] = y[i];
    force[3 * i + 1] = -S(radius * x);
    force[3 * i + 2] = -S(radius * z);
  }
  if (any_sticks) {
    // Removes the effect of all others on the tangential velocities of sticking contacts.
    for (int i = 0; i < 2 * n; ++i) {
      const S* const row = W + (3 * (i / 2) + 1 + i % 2) * rows;
      S sum(0.0);
      for (int c = 0; c < rows; ++c) sum += row[c] * force[c];
      b[i] = sum;
    }
    for (int i = 0; i < 2 * n; ++i) {
      const S* const row = table + at.undo() + 2 * n * i;
      S sum(0.0);
      for (int c = 0; c < 2 * n; ++c) sum += row[c] * b[c];
      S& own = force[3 * (i / 2) + 1 + i % 2];
      own = select(S(kFrictionless) < table[at.spring(i / 2) + PathTable::slow], S(own - sum), own);
    }
  }
  for (int i = 0; i < n; ++i) {
    const S* const spring = table + at.spring(i);
    const S u_n = u[3 * i], f = y[i], power = f * u_n, loading = spring[PathTable::loading];
    rate[i] = spring[PathTable::pull] + spring[PathTable::pace] * S(u_n - spring[PathTable::released]);
    rate[4 * n + i] = loading * f;
    rate[5 * n + i] = loading * power;
    rate[6 * n + i] = power;
    rate[7 * n + i] = force[3 * i + 1] * u[3 * i + 1] + force[3 * i + 2] * u[3 * i + 2];
  }
}

template <class S, int N = 0>
class PackedPathSteps : public PathSteps {
 public:
  explicit PackedPathSteps(int contacts)
      : at_{contacts},
        numbers_(at_.size() + 3 + 8 * at_.state() + (dop853::kStages + 1) * at_.state()),
        data_(new S[static_cast<unsigned long>(numbers_)]()) {
    const int y = at_.state();
    S* next = data_;
    const auto take = [&next](int count) GRAPNEL_INLINE_LAMBDA {
      S* const taken = next;
      next += count;
      return taken;
    };
    table_ = take(at_.size()), size_ = take(1), y_ = take(y), end_ = take(y), u_ = take(y), end_rate_ = take(y);
    error_ = take(2), state_ = take(y), b_ = take(y), stages_ = take(dop853::kStages * y);
    for (int i = 0; i < numbers_; ++i) data_[i] = S(0.0);
    // A scalar consists of its lanes' doubles only.
    static_assert(sizeof(S) == contact_path_kernel::kWidth<S> * sizeof(double));
    const auto doubles = [](S* at) GRAPNEL_INLINE_LAMBDA { return reinterpret_cast<double*>(at); };
    lanes.width = contact_path_kernel::kWidth<S>;
    lanes.table = doubles(table_), lanes.size = doubles(size_);
    lanes.y = doubles(y_), lanes.rate = doubles(stages_), lanes.end = doubles(end_);
    lanes.end_u = doubles(u_), lanes.end_rate = doubles(end_rate_), lanes.error = doubles(error_);
  }
  ~PackedPathSteps() override { delete[] data_; }

  void try_all() override {
    using namespace contact_path_kernel;
    any_sticks_ = false;
    for (int i = 0; i < at_.n; ++i)
      any_sticks_ = any_sticks_ || any(S(kFrictionless) < table_[at_.spring(i) + PathTable::slow]);
    stage<2, dop853::kStage2>();
    stage<3, dop853::kStage3>();
    stage<4, dop853::kStage4>();
    stage<5, dop853::kStage5>();
    stage<6, dop853::kStage6>();
    stage<7, dop853::kStage7>();
    stage<8, dop853::kStage8>();
    stage<9, dop853::kStage9>();
    stage<10, dop853::kStage10>();
    stage<11, dop853::kStage11>();
    stage<12, dop853::kStage12>();
    finish();
    path_rates<N>(at_, table_, any_sticks_, end_, u_, b_, end_rate_);
  }

 private:
  // Forces and impulses only: no other number of y is an input.
  template <int kNumber, const auto& kRow>
  void stage() {
    const S h = *size_;
    const int n = N > 0 ? N : at_.n, y = 8 * n;
    for (int i = 0; i < 4 * n; ++i) state_[i] = y_[i] + h * dop853::weighted_sum<kRow>(stages_, y, i);
    path_rates<N>(at_, table_, any_sticks_, state_, u_, b_, stages_ + (kNumber - 1) * y);
  }

  // The step's end and the norms of both error estimates: the maximum over forces, impulses (as their effect on
  // velocities), and the energy balance.
  void finish() {
    using namespace contact_path_kernel;
    const S h = *size_;
    const int n = N > 0 ? N : at_.n, y = 8 * n;
    S error5(0.0), error3(0.0), sum(0.0);
    for (int i = 0; i < y; ++i) {
      const S slope = dop853::weighted_sum<dop853::kSolution>(stages_, y, i);
      end_[i] = y_[i] + h * slope;
      const S scale = i >= n && i < 4 * n ? table_[at_.scale() + i - n] : S(1.0);
      error5 = max(error5, abs(S(scale * dop853::weighted_sum<dop853::kError5>(stages_, y, i))));
      error3 = max(error3, abs(S(scale * S(slope - dop853::weighted_sum<dop853::kThirdOrder>(stages_, y, i)))));
      sum += S(0.0) * end_[i];  // NaN if any is not finite, which the maximum could miss
    }
    const S size = abs(h);
    error_[0] = size * error5 + sum;
    error_[1] = size * error3 + sum;
  }

  const PathTable at_;
  const int numbers_;
  S* const data_;
  S *table_, *size_, *y_, *end_, *u_, *end_rate_, *error_, *state_, *b_, *stages_;
  bool any_sticks_ = false;
};

/// Specialized implementations for the most common numbers of contacts.
template <class S>
PathSteps* new_path_steps(int contacts) {
  if (contacts == 1) return new PackedPathSteps<S, 1>(contacts);
  if (contacts == 2) return new PackedPathSteps<S, 2>(contacts);
  return new PackedPathSteps<S>(contacts);
}

}  // namespace grapnel
