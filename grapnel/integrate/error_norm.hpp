#pragma once

/// @file
/// How large a difference of two states is, measured against tolerances on the manifold: an ordinary number against
/// atol + rtol·max(|y0|, |y1|), a quaternion by the rotation vector that separates the two orientations (3 numbers
/// [rad], not 4) against atol + rtol·1 rad. A change of a quaternion's norm costs nothing, since it is projected away.
/// Thread safety: an `ErrorNorm` is immutable, so that threads may share it.

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/integrate/manifold.hpp"

namespace grapnel {

/// What local error per step is acceptable.
struct Tolerances {
  double rtol = 1e-10;  // relative to the number's magnitude; to one radian for a quaternion
  double atol = 1e-12;  // absolute, for every number, in that number's unit; must be positive
  // Instead of atol, one for each of the state's numbers; empty: atol holds for all. The entries at a quaternion's x,
  // y, z hold for the rotation vector [rad], the one at w is unused.
  std::vector<double> atol_components = {};
};

/// Weighted root-mean-square norm on a manifold.
template <class S>
class ErrorNorm {
 public:
  /// Throws std::invalid_argument if the manifold is invalid, if rtol is negative or not finite, if an absolute
  /// tolerance is not positive and finite, or if atol_components has neither 0 nor manifold.size entries.
  ErrorNorm(const Manifold& manifold, const Tolerances& tolerances);

  /// How many independent errors the norm counts: 3 for each controlled quaternion, 1 for each other controlled number.
  int dimension() const { return dimension_; }

  /// Sum over the controlled numbers of (difference/scale)²; the scale is that of the states y0 and y1. A
  /// quaternion's difference δq counts as its rotation vector 2 Im(conj(q1) ⊗ δq). Arguments are n numbers. Throws
  /// nothing.
  S sum_of_squares(std::span<const S> y0, std::span<const S> y1, std::span<const S> difference) const;

  /// Root mean square of y/scale(y): how large a state is in units of its tolerance; a quaternion counts as one radian.
  double magnitude(std::span<const S> y) const;

  /// Root mean square of difference/scale(y), for a difference or a rate at the state y. Throws nothing.
  double operator()(std::span<const S> y, std::span<const S> difference) const {
    return root_mean(sum_of_squares(y, y, difference));
  }

 private:
  struct Range {
    int begin;
    int end;
  };

  double root_mean(const S& sum) const {
    using std::sqrt;
    return dimension_ == 0 ? 0.0 : static_cast<double>(sqrt(sum * S(1.0 / dimension_)));
  }

  double rtol_;
  std::vector<double> atol_;      // n numbers
  std::vector<Range> vectors_;    // controlled runs of ordinary numbers
  std::vector<int> quaternions_;  // controlled quaternions
  int dimension_ = 0;
};

template <class S>
ErrorNorm<S>::ErrorNorm(const Manifold& manifold, const Tolerances& tolerances)
    : rtol_(tolerances.rtol), atol_(tolerances.atol_components) {
  validate(manifold);
  const auto reject = [](const std::string& fault) { throw std::invalid_argument("Tolerances: " + fault); };
  if (!(rtol_ >= 0.0 && std::isfinite(rtol_))) reject("rtol must be finite and not negative");
  if (atol_.empty()) atol_.assign(static_cast<std::size_t>(manifold.size), tolerances.atol);
  if (atol_.size() != static_cast<std::size_t>(manifold.size)) {
    reject("atol_components has " + std::to_string(atol_.size()) + " entries for a state of " +
           std::to_string(manifold.size));
  }
  for (const double atol : atol_) {
    if (!(atol > 0.0 && std::isfinite(atol))) reject("every absolute tolerance must be positive and finite");
  }

  // The gaps between quaternions are the runs of ordinary numbers.
  std::vector<bool> in_quaternion(static_cast<std::size_t>(manifold.size), false);
  const int controlled = manifold.controlled_size();
  for (const int offset : manifold.quaternions) {
    for (int i = 0; i < 4; ++i) in_quaternion[static_cast<std::size_t>(offset + i)] = true;
    if (offset < controlled) quaternions_.push_back(offset);
  }
  dimension_ = 3 * static_cast<int>(quaternions_.size());
  for (int i = 0; i < controlled; ++i) {
    if (in_quaternion[static_cast<std::size_t>(i)]) continue;
    if (vectors_.empty() || vectors_.back().end != i) vectors_.push_back({i, i});
    ++vectors_.back().end;
    ++dimension_;
  }
}

template <class S>
S ErrorNorm<S>::sum_of_squares(std::span<const S> y0, std::span<const S> y1, std::span<const S> difference) const {
  using std::abs;
  using std::max;
  S sum(0.0);
  for (const Range& range : vectors_) {
    for (int i = range.begin; i < range.end; ++i) {
      const S magnitude = max(S(abs(y0[i])), S(abs(y1[i])));
      const S ratio = difference[i] / (S(atol_[i]) + rtol_ * magnitude);
      sum = sum + ratio * ratio;
    }
  }
  for (const int offset : quaternions_) {
    const S* q = y1.data() + offset;
    const S* d = difference.data() + offset;
    // Im(conj(q) ⊗ d) = q_w d_v − d_w q_v − q_v × d_v
    const S rotation[3] = {S(2.0) * (q[0] * d[1] - d[0] * q[1] - q[2] * d[3] + q[3] * d[2]),
                           S(2.0) * (q[0] * d[2] - d[0] * q[2] - q[3] * d[1] + q[1] * d[3]),
                           S(2.0) * (q[0] * d[3] - d[0] * q[3] - q[1] * d[2] + q[2] * d[1])};
    for (int i = 0; i < 3; ++i) {
      const S ratio = rotation[i] * S(1.0 / (atol_[offset + 1 + i] + rtol_));
      sum = sum + ratio * ratio;
    }
  }
  return sum;
}

template <class S>
double ErrorNorm<S>::magnitude(std::span<const S> y) const {
  using std::abs;
  S sum(0.0);
  for (const Range& range : vectors_) {
    for (int i = range.begin; i < range.end; ++i) {
      const S ratio = y[i] / (S(atol_[i]) + rtol_ * S(abs(y[i])));
      sum = sum + ratio * ratio;
    }
  }
  for (const int offset : quaternions_) {
    for (int i = 1; i < 4; ++i) {
      const double ratio = 1.0 / (atol_[offset + i] + rtol_);
      sum = sum + S(ratio * ratio);
    }
  }
  return root_mean(sum);
}

}  // namespace grapnel
