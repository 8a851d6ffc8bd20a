#pragma once

/// @file
/// The error norm of integrate/error_norm.hpp in packs: what it measures and why is written there. A text of its own,
/// since with one tolerance for all numbers both error estimates share its divisions.

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/lanes/pack.hpp"

namespace grapnel::lanes {

/// Sums of (difference/scale)^2 over a state.
template <class S>
class LaneErrorNorm {
 public:
  LaneErrorNorm(const PhaseTables& tables, int size)
      : tables_(tables),
        size_(size),
        is_ordinary_(size),
        inverse_angle_(1.0 / (tables.absolute_tolerance + tables.relative_tolerance)) {
    for (int i = 0; i < size; ++i) is_ordinary_[i] = 1;
    for (int k = 0; k < tables.quaternion_count; ++k) {
      for (int i = 0; i < 4; ++i) is_ordinary_[tables.quaternions[k] + i] = 0;
    }
  }

  /// Of two differences of the states y0 and y1 at once.
  void sums(const S* y0, const S* y1, const S* a, const S* b, S& sum_a, S& sum_b) const {
    const S rtol(tables_.relative_tolerance), atol(tables_.absolute_tolerance);
    sum_a = sum_b = S(0.0);
    for (int i = 0; i < size_; ++i) {
      if (is_ordinary_[i] == 0) continue;
      const S inverse = S(1.0) / S(rtol * max(abs(y0[i]), abs(y1[i])) + atol);
      const S ratio_a = a[i] * inverse, ratio_b = b[i] * inverse;
      sum_a += ratio_a * ratio_a;
      sum_b += ratio_b * ratio_b;
    }
    for (int k = 0; k < tables_.quaternion_count; ++k) {
      const int offset = tables_.quaternions[k];
      add_rotation(y1 + offset, a + offset, sum_a);
      add_rotation(y1 + offset, b + offset, sum_b);
    }
  }

  /// Root mean squares of a difference at y and of y itself.
  S of(const S* y, const S* difference) const {
    S sum, same;
    sums(y, y, difference, difference, sum, same);
    return root_mean(sum);
  }
  S magnitude(const S* y) const {
    S sum(0.0);
    for (int i = 0; i < size_; ++i) {
      if (is_ordinary_[i] == 0) continue;
      const S ratio = y[i] / S(S(tables_.relative_tolerance) * abs(y[i]) + S(tables_.absolute_tolerance));
      sum += ratio * ratio;
    }
    return root_mean(sum + S(3.0 * tables_.quaternion_count * inverse_angle_ * inverse_angle_));
  }

 private:
  GRAPNEL_INLINE S root_mean(const S& sum) const {
    return tables_.dimension == 0 ? S(0.0) : sqrt(S(sum * S(1.0 / tables_.dimension)));
  }
  // A quaternion's difference as the rotation vector 2 Im(conj(q) d).
  GRAPNEL_INLINE void add_rotation(const S* q, const S* d, S& sum) const {
    const S twice(2.0 * inverse_angle_);
    const S x = (q[0] * d[1] - d[0] * q[1]) - (q[2] * d[3] - q[3] * d[2]);
    const S y = (q[0] * d[2] - d[0] * q[2]) - (q[3] * d[1] - q[1] * d[3]);
    const S z = (q[0] * d[3] - d[0] * q[3]) - (q[1] * d[2] - q[2] * d[1]);
    const S rx = twice * x, ry = twice * y, rz = twice * z;
    sum += rx * rx;
    sum += ry * ry;
    sum += rz * rz;
  }

  const PhaseTables& tables_;
  int size_;
  LaneArray<S, std::uint8_t> is_ordinary_;
  double inverse_angle_;
};

}  // namespace grapnel::lanes
