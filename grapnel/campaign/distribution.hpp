#pragma once

/// @file
/// Distributions by the inverse of their distribution function: from coordinates that are uniform in (0, 1) to values.
/// Thread safety: pure functions of plain values.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/spatial/rotation.hpp"

namespace grapnel {

/// P(Z <= z) of the standard normal distribution.
double normal_probability(double z);
/// Its inverse, to about 1e-16 relative: algorithm AS 241, PPND16 (Wichura 1988, Applied Statistics 37, 477-484).
/// 0 < p < 1.
double normal_quantile(double p);

/// One number's distribution.
struct NumberDistribution {
  /// constant: `location`. normal: mean `location`, standard deviation `scale`. log_normal: median `location`, `scale`
  /// the standard deviation of the natural logarithm. Both may be cut off at `from` and `to`. uniform: `from` to `to`.
  /// integers: whole numbers from `from` to `to`, both included, equally likely; at most 2^53.
  enum class Kind { constant, normal, log_normal, uniform, integers };
  Kind kind = Kind::constant;
  double location = 0;
  double scale = 0;
  double from = 0, to = 0;
  bool cut = false;  // normal, log_normal: only what is from `from` to `to` counts

  bool is_constant() const { return kind == Kind::constant; }
  /// The bounds of one that is cut, in standard deviations from its middle; of a log_normal one, of the logarithm.
  std::array<double, 2> standard_bounds() const;
  /// The value at probability u, 0 < u < 1.
  double at(double u) const;
};

/// A direction uniform on the sphere: a unit vector (Archimedes: its z is uniform).
Vector3d random_direction(double u, double v);
/// A rotation uniform on SO(3): a unit quaternion (Shoemake 1992, Graphics Gems III, 124-132).
Quaterniond random_rotation(double u, double v, double w);
/// The rotation by a rotation vector [rad].
Quaterniond rotation_by(const Vector3d& rotation_vector);
/// `vector` turned towards a direction at random: by the angle |t| about an axis perpendicular to it, where the two
/// components of t [rad] are given. Zero stays zero.
Vector3d tilted(const Vector3d& vector, double t1, double t2);

/// Lower triangular L, row by row, with L L^T = a symmetric `n` by `n` matrix, row by row; empty if the matrix is
/// indefinite beyond rounding (1e-12 of its largest diagonal element). What is semidefinite is well: columns of zeros.
std::optional<std::vector<double>> semidefinite_factor(std::span<const double> matrix, std::size_t n);

/// Which of several things with positive weights, given as their running sums, is chosen by u.
std::size_t chosen(std::span<const double> running_sums, double u);

}  // namespace grapnel
