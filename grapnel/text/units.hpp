#pragma once

/// @file
/// Numbers that a file writes with a unit: "30 deg", "250 mm", "0.2 kg m^2", "1.5 N m/rad". A unit is a product of
/// metres, grams, seconds, radians, newtons and the like with SI prefixes and powers; what it says is compared with the
/// unit that a place of a file has by dimension, and the number becomes one in that unit. An angle is a dimension of
/// its own: revolutions are no hertz. Numbers are scaled as decimals, and rounded once: 250 mm are the double 0.25.

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

/// What a unit means.
struct Unit {
  std::array<int, 4> powers{};   ///< of m, kg, s, rad, in tenths: contacts have N/m^1.5
  DecimalFactor to_si, from_si;  ///< what a number in it is multiplied with; the inverse

  bool has_dimension_of(const Unit& other) const { return powers == other.powers; }
  bool is_dimensionless() const { return powers == std::array<int, 4>{}; }
};

/// "N m/rad", "deg/s", "1/s^2", "kg m²"; empty for anything else.
std::optional<Unit> unit_named(std::string_view text);

/// The two parts of "30 deg" and "30deg"; empty unless a number is followed by something that looks like a unit.
struct NumberAndUnit {
  std::string_view number, unit;
};
std::optional<NumberAndUnit> number_and_unit(std::string_view text);
/// The number in the SI unit of its dimension.
double in_si(const NumberAndUnit& value, const Unit& unit);

/// The units that a description states for a place: two of "rad or m", which are those of joints that turn and of
/// joints that slide, three of "s, N, N m". "1" is that of numbers without a dimension.
std::vector<std::string_view> units_of_place(std::string_view stated);

/// What became of a value that may have a unit.
enum class UnitReading {
  none,    ///< it has none, and is as it was
  taken,   ///< it is a plain number now, in the place's unit; Node::unit says in which of them
  refused  ///< the unit is none, or none of the place's: a fault has been added, once
};
/// Makes a number with a unit a plain one in the unit that is stated for its place (empty: none). `name` is the
/// value's, for messages.
UnitReading take_unit(Node& node, std::string_view stated, const std::string& name, FaultList& faults);

/// "an angle [rad, deg, mrad]", "a length [m, mm, cm, km]" of a unit; "a number [kg/m]" of one without a name.
std::string expected_of(std::string_view unit);

/// The regular expression of texts that are numbers with units, for JSON Schemas.
const std::string& number_with_unit_pattern();

}  // namespace grapnel
