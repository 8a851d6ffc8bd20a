#pragma once

/// @file
/// The axes of a study, the points of their grid, and their order.

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// One value of an axis in tables: a number, or a text if the axis is not numeric.
struct AxisValue {
  double number = NAN;
  std::string label;
};

struct StudyAxis {
  std::string name;         // path, quantity, or label of the study
  std::string unit;         // of the displayed numbers; empty: unknown, or no numbers
  std::string description;  // what the axis changes
  bool is_numeric = false;
  std::vector<AxisValue> values;
};

template <>
const Type& type_of<StudyAxis>();

/// Its values in results: numbers, or labels.
std::vector<std::variant<double, std::string>> shown_values(const StudyAxis& axis);

/// Position on each axis of a point, counted from 0: the first axis varies slowest.
std::vector<std::size_t> grid_position(std::span<const std::size_t> sizes, std::size_t point);

/// `count` values from `from` to `to`, both ends exact; with `logarithmic` equal ratios (both ends of one sign).
std::vector<double> spaced_values(double from, double to, std::size_t count, bool logarithmic);

}  // namespace grapnel
