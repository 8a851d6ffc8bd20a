#pragma once

/// @file
/// Uncertain values: how the numbers at one place of a scenario, or at several, are drawn. Thread safety: pure
/// functions of plain values.

#include <cstddef>
#include <span>
#include <variant>
#include <vector>

#include "grapnel/campaign/distribution.hpp"

namespace grapnel {

/// What a drawn number is to the scenario's own: it takes its place, multiplies it, or is added to it.
enum class ValueForm { value, factor, offset };

/// Numbers one by one, each with a distribution of its own.
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
