#pragma once

/// @file
/// What joints' sensors misread (simulate/tracking_noise.hpp), in packs: a text of its own, since a sum of 24 cosines
/// at every stage of every step would cost more than the dynamics; over one step it is its Taylor series about the
/// step's middle, whose coefficients take one sine and cosine per tone and step.

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/lanes/pack.hpp"

namespace grapnel::lanes {

template <class S>
class LaneNoise {
 public:
  explicit LaneNoise(const PhaseTables& tables)
      : tables_(tables), tones_(tables.noise_numbers), series_(tables.link_count * kOrder) {}

  /// The step after which a series would no longer be exact to rounding: half of it turns the fastest tone by
  /// kLargestTurn, and 3^24 / 24! = 5e-13 of the amplitude, itself a small angle.
  static double longest_step(const PhaseTables& tables, const double* noise) {
    double fastest = 0;
    for (int i = 0; i < tables.link_count; ++i) {
      if (tables.links[i].tones < 0) continue;
      for (int k = 0; k < kTones; ++k) {
        const double w = noise[tables.links[i].tones + 1 + 2 * k];
        if (w > fastest) fastest = w;
      }
    }
    return fastest > 0 ? 2 * kLargestTurn / fastest : __builtin_inf();
  }

  void load_case(int lane, const double* noise) {
    for (int i = 0; i < tables_.noise_numbers; ++i) tones_[i].set(lane, noise[i]);
  }

  /// From now on n is known between t and t + step.
  void expand(const S& t, const S& step) {
    if (tables_.noise_numbers == 0) return;
    half_ = select(step > S(0.0), S(S(0.5) * step), S(1e-3));
    inverse_half_ = S(1.0) / half_;
    middle_ = t + S(0.5) * step;
    for (int i = 0; i < tables_.link_count; ++i) {
      if (tables_.links[i].tones >= 0)
        expand_joint(tones_.data() + tables_.links[i].tones, series_.data() + i * kOrder);
    }
  }

  /// n, n' and, if kSecond, n'' of a joint.
  template <bool kSecond>
  GRAPNEL_INLINE BasicJointPoint<S> at(const LinkTable& link, const S& t) const {
    const S* a = series_.data() + (&link - tables_.links) * kOrder;
    const S x = (t - middle_) * inverse_half_;
    S n(0.0), d(0.0), e(0.0);  // value, derivative, half the second
    for (int m = kOrder; m-- > 0;) {
      if constexpr (kSecond) e = e * x + d;
      d = d * x + n;
      n = n * x + a[m];
    }
    return {n, S(d * inverse_half_), S(S((e + e) * inverse_half_) * inverse_half_)};
  }

 private:
  static constexpr int kOrder = 24;
  static constexpr double kLargestTurn = 3;

  // sum_k A cos(angle_k + w_k half x) = sum_m x^m / m! (A sum_k (w_k half)^m cos^(m)(angle_k)).
  void expand_joint(const S* tone, S* series) const {
    S sum[kOrder];
    for (int m = 0; m < kOrder; ++m) sum[m] = S(0.0);
    for (int k = 0; k < kTones; ++k) {
      const S w = tone[1 + 2 * k];
      const SineCosine<S> angle = sine_cosine(S(w * middle_ + tone[2 + 2 * k]));
      const S turn = w * half_;
      const S square = -(turn * turn);
      S even = angle.cosine, odd = -(turn * angle.sine);
#pragma GCC unroll 12
      for (int m = 0; m < kOrder; m += 2) {
        sum[m] += even;
        sum[m + 1] += odd;
        even = even * square;
        odd = odd * square;
      }
    }
    S factor = tone[0];
    for (int m = 0; m < kOrder; ++m) {
      series[m] = sum[m] * factor;
      factor = factor * S(1.0 / (m + 1));
    }
  }

  const PhaseTables& tables_;
  LaneArray<S> tones_;
  LaneArray<S> series_;  // kOrder per link
  S middle_ = S(0.0), half_ = S(1.0), inverse_half_ = S(1.0);
};

}  // namespace grapnel::lanes
