#pragma once

/// @file
/// The manifold of a state: a flat list of n numbers in which some groups of four are unit quaternions. The steppers
/// treat the numbers as a vector during a step and project onto the manifold after it (projection method; Hairer,
/// Lubich, Wanner, Geometric Numerical Integration, 2nd ed., IV.4), which preserves the order of the method. Thread
/// safety: `Manifold` is a plain value, and the functions here have no state.

#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace grapnel {

/// Numbers of a state from `begin` to before `end`.
struct NumberRange {
  int begin, end;
  bool operator==(const NumberRange&) const = default;
};

/// Layout of a state y of `size` numbers.
struct Manifold {
  static constexpr int kAllControlled = -1;

  int size = 0;                       // n: how many numbers
  std::vector<int> quaternions = {};  // offset of each unit quaternion (w, x, y, z), four consecutive numbers
  int controlled = kAllControlled;  // number of leading numbers under error control; the others are integrated without

  /// Number of leading numbers under error control, in 0 … size.
  int controlled_size() const { return controlled == kAllControlled ? size : controlled; }
};

/// The numbers of a state of `size` numbers outside of `ranges`, which are increasing and do not overlap.
std::vector<NumberRange> numbers_beside(int size, std::span<const NumberRange> ranges);

/// Checks a manifold. Throws std::invalid_argument that names the error: size is negative, a quaternion lies outside
/// the state, overlaps another one or straddles the end of the controlled part, or that end lies outside the state.
void validate(const Manifold& manifold);

/// Scales every quaternion in y (manifold.size numbers) to unit norm.
/// @return the largest |‖q‖ − 1| before the scaling; 0 if there is no quaternion. A zero quaternion becomes NaN. Throws
/// nothing.
template <class S>
double normalize(const Manifold& manifold, std::span<S> y) {
  using std::sqrt;
  double largest_defect = 0.0;
  for (const int offset : manifold.quaternions) {
    S* q = y.data() + offset;
    const S norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const S inverse = S(1.0) / norm;
    for (int i = 0; i < 4; ++i) q[i] = q[i] * inverse;
    const double defect = std::abs(static_cast<double>(norm - S(1.0)));
    if (defect > largest_defect || std::isnan(defect)) largest_defect = defect;  // NaN is kept
  }
  return largest_defect;
}

/// Whether every number in y, and its square, is finite. Throws nothing.
template <class S>
bool all_finite(std::span<const S> y) {
  bool finite = true;
  for (const S& value : y) finite &= std::isfinite(static_cast<double>(value * value * S(0.0)));
  return finite;
}

}  // namespace grapnel
