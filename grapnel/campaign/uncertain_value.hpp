#pragma once

/// @file
/// Uncertain values: how the numbers at one place of a scenario, or at several, are drawn. Thread safety: pure
/// functions of plain values.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

// Distributions by the inverse of their distribution function: from coordinates that are uniform in (0, 1) to values.

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
Quaterniond quaternion_by(const Vector3d& rotation_vector);
/// `vector` turned towards a direction at random: by the angle |t| about an axis perpendicular to it, where the two
/// components of t [rad] are given. Zero stays zero.
Vector3d tilted(const Vector3d& vector, double t1, double t2);

/// Lower triangular L, row by row, with L L^T = a symmetric `n` by `n` matrix, row by row; empty if the matrix is
/// indefinite beyond rounding (1e-12 of its largest diagonal element). What is semidefinite is well: columns of zeros.
std::optional<std::vector<double>> semidefinite_factor(std::span<const double> matrix, std::size_t n);

/// Which of several things with positive weights, given as their running sums, is chosen by u.
std::size_t chosen(std::span<const double> running_sums, double u);

/// What a drawn number is to the scenario's own: it takes its place, multiplies it, or is added to it.
enum class ValueForm { value, factor, offset };

/// Independent numbers, each with its distribution.
struct IndependentNumbers {
  std::vector<NumberDistribution> distributions;  // per number
  ValueForm form = ValueForm::value;
};
/// Numbers that all follow from one that is drawn.
struct CommonNumber {
  NumberDistribution distribution;
  ValueForm form = ValueForm::factor;
};
/// Normal with a covariance.
struct CorrelatedNumbers {
  std::vector<double> mean;
  std::vector<double> factor;  // semidefinite_factor() of the covariance
  ValueForm form = ValueForm::offset;
};
/// A vector of a random direction.
struct SphereVector {
  NumberDistribution length;
};
/// The scenario's own vector, tilted, and its length multiplied.
struct TiltedVector {
  double deviation = 0;  // of the tilt about each of two axes perpendicular to the vector [rad]
  NumberDistribution factor;
};
/// A unit quaternion (w, x, y, z): uniform on SO(3), or the scenario's own turned a little.
struct UncertainRotation {
  bool uniform = false;
  double deviation = 0;  // of each component of the rotation vector, in the turned frame [rad]
};
/// One of several values; its number among them is drawn.
struct ChosenValue {
  std::vector<double> running_sums;  // of the weights
};

using UncertainValue = std::variant<IndependentNumbers, CommonNumber, CorrelatedNumbers, SphereVector, TiltedVector,
                                    UncertainRotation, ChosenValue>;

/// Means and covariance of the numbers that vary. They are numbers for the scenario; of a CommonNumber the drawn
/// number, of a TiltedVector the tilt about two axes [rad] and the factor, of an UncertainRotation the rotation vector
/// [rad].
struct ValueMoments {
  std::vector<double> mean;
  std::vector<double> covariance;  // row by row
};
/// Empty for values without a mean: of random directions and orientations, whole numbers and choices. `nominal`: the
/// scenario's own numbers.
std::optional<ValueMoments> moments_of(const UncertainValue& value, std::span<const double> nominal);

/// The mean and the variance of one number.
std::array<double, 2> moments_of(const NumberDistribution& distribution);

/// The numbers of the scenario for numbers as those of ValueMoments::mean. None: the value is held at the scenario's
/// own numbers, a ChosenValue at the number of its most probable choice.
std::vector<double> placed_numbers(const UncertainValue& value, std::span<const double> nominal,
                                   std::span<const double> varying);

/// Coordinates of the unit cube that a draw takes.
std::size_t dimensions(const UncertainValue& value);

/// Whether nothing of the scenario's own numbers is left in what is drawn.
bool replaces(const UncertainValue& value);

struct DrawnValue {
  std::vector<double> numbers;  // as many as the scenario's own; of a ChosenValue its number among them
  /// What tables show: the numbers that are not constant; of a CommonNumber the number drawn; of a SphereVector or a
  /// TiltedVector its components and, if it varies, the length; of an UncertainRotation the quaternion if it is
  /// uniform, else the rotation vector [rad].
  std::vector<double> shown;
};

/// The value at a point of the unit cube, from the scenario's own numbers.
DrawnValue draw_value(const UncertainValue& value, std::span<const double> nominal, std::span<const double> point);

}  // namespace grapnel
