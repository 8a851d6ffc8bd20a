#pragma once

/// @file
/// Numbers that a file writes with a unit: "30 deg", "250 mm", "0.2 kg m^2", "1.5 N m/rad". A unit is a product of
/// metres, grams, seconds, radians, newtons and similar units with SI prefixes and powers. Its dimension must match the
/// unit of the key, and the number is converted to that unit. Angle is a separate dimension: revolutions per second are
/// not hertz. Numbers are scaled as decimals and rounded once: 250 mm is the double 0.25.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A decimal number, `digits` times 10^`exponent`.
struct DecimalFactor {
  std::string digits = "1";
  int exponent = 0;
};

/// A parsed unit.
struct Unit {
  std::array<int, 4> powers{};   ///< of m, kg, s, rad, in tenths: contacts have N/m^1.5
  DecimalFactor to_si, from_si;  ///< conversion factor; its inverse

  bool has_dimension_of(const Unit& other) const { return powers == other.powers; }
  bool is_dimensionless() const { return powers == std::array<int, 4>{}; }
};

/// "N m/rad", "deg/s", "1/s^2", "kg m²"; empty for anything else.
std::optional<Unit> unit_named(std::string_view text);

/// The two parts of "30 deg" and "30deg"; empty unless a number is followed by a possible unit.
struct NumberAndUnit {
  std::string_view number, unit;
};
std::optional<NumberAndUnit> number_and_unit(std::string_view text);
/// The number in the SI unit of its dimension.
double in_si(const NumberAndUnit& value, const Unit& unit);

/// The units that a description states for a place: two for "rad or m", for revolute and prismatic joints, three for
/// "s, N, N m". "1" is the unit of dimensionless numbers.
std::vector<std::string_view> units_of_place(std::string_view stated);

/// Result of converting a value that may have a unit.
enum class UnitReading {
  none,    ///< no unit; the value is unchanged
  taken,   ///< converted to a plain number in the unit of the place; Node::unit is the index of that unit
  refused  ///< unknown or unsuitable unit; an error has been added once
};
/// Converts a number with a unit to a plain number in the unit of its place (empty: none). `name` is the value's name
/// in messages.
UnitReading take_unit(Node& node, std::string_view stated, const std::string& name, FaultList& faults);

/// "an angle [rad, deg, mrad]", "a length [m, mm, cm, km]" for a unit; "a number [kg/m]" for a unit without a named
/// quantity.
std::string expected_of(std::string_view unit);

/// Regular expression of numbers with units, for JSON Schemas.
const std::string& number_with_unit_pattern();

}  // namespace grapnel
