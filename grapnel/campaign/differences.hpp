#pragma once

/// @file
/// Derivatives of functions that are expensive and may have kinks and jumps, by central differences with extrapolation,
/// with an error estimate and a verdict per entry (docs/theory, section 29). Thread safety: pure functions.

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// yes: the two one-sided derivatives agree and the error is small. no: they differ, or the outcome jumps. not_decided:
/// the error is too large for either.
enum class Differentiable { yes, no, not_decided };
template <>
const Type& type_of<Differentiable>();

/// The value of a function at a point.
struct FunctionValue {
  std::vector<double> values;  // per outcome; NaN if it does not exist. Empty: `failure` states why
  /// Discrete properties, by their names, such as the number of impacts: in the order of the names.
  std::vector<std::pair<std::string, std::string>> events = {};
  std::string failure = {};  // the function has no value here
  bool is_outside = false;   // the point is invalid, so that the derivative is taken from the other side
};

/// A variable of the function.
struct DifferenceVariable {
  double value = 0;
  double size = 1;  // change of the variable that matters: its magnitude, or its standard deviation
  double step = 0;  // the first step
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
};

/// The derivative of one outcome by one variable.
struct DerivativeEntry {
  Differentiable verdict = Differentiable::not_decided;
  double derivative = std::numeric_limits<double>::quiet_NaN();
  double error = std::numeric_limits<double>::quiet_NaN();  // estimated, absolute
  std::optional<double> left = {}, right = {};              // one-sided derivatives, if they differ
  std::string reason = {};                                  // of a verdict other than yes
  double step = 0;                                          // the largest step of the best estimate
  bool is_one_sided = false;                                // beside a bound of the variable
};

/// Evaluates the function at many points, in any order or concurrently.
using FunctionAt = std::function<std::vector<FunctionValue>(const std::vector<std::vector<double>>& points)>;

/// Limits of a verdict.
inline constexpr double kDerivativeAccuracy = 0.01;  // largest error of a determined derivative, relative to it
inline constexpr double kNegligibleChange = 1e-6;    // of an outcome, relative to its scale, for a change by `size`

/// Derivatives per variable and outcome. `center`: the function at the values of the variables. `scales`: per outcome,
/// the magnitude relative to which changes are negligible; positive. `accuracy`: of values, relative. Every variable
/// takes 6, 12 or 18 evaluations.
std::vector<std::vector<DerivativeEntry>> differentiate(const FunctionAt& function, const FunctionValue& center,
                                                        std::span<const DifferenceVariable> variables,
                                                        std::span<const double> scales, double accuracy = 1e-15);

}  // namespace grapnel
