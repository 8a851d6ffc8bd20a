#pragma once

/// @file
/// The published JSON Schemas, the check of a document against them, and their content at one place. They are the
/// single definition of keys, types, ranges and defaults; those of scenarios and robots are generated from the
/// descriptions (sections.hpp).

#include <cmath>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "grapnel/describe/type.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A self-contained draft-7 schema of files that hold the structure. Structures within it are definitions by their
/// names. Units are "x-unit", magnitudes other than the unit's "x-largest", the largest plausible magnitude
/// "x-plausible", infinite numbers "x-infinity".
nlohmann::ordered_json schema_of(const Type& type, const std::string& title);

/// Self-contained draft-7 schemas, as objects.
const nlohmann::ordered_json& scenario_schema_document();
const nlohmann::ordered_json& robot_schema_document();
/// Schema of a ready-made target: the keys of a target in a scenario, except for its state, which the scenario states.
const nlohmann::ordered_json& target_schema_document();

/// Checks the structure: keys, types, lengths, ranges, choices. `document` names the whole in messages ("the
/// scenario"); `path` is its path within a larger document. A misspelt key is reported and corrected, so that its value
/// is checked too and it is not reported as missing.
void check_structure(Node& node, const nlohmann::ordered_json& schema, const std::string& document, FaultList& faults,
                     const std::string& path = {});

/// The published schema: texts such as "30 deg" are allowed for numbers with a unit.
std::string published(nlohmann::ordered_json schema);

/// Adds absent values that have a default, so that readers need no defaults.
void fill_defaults(Node& node, const nlohmann::ordered_json& schema);

// ---- Places ----

/// Unit and range of the number, or of every number of the list, at a place.
struct PlaceRule {
  std::string unit;  // empty: none is stated
  std::string description;
  double above = -std::numeric_limits<double>::infinity();  // the number must be greater
  double from = -std::numeric_limits<double>::infinity(), to = std::numeric_limits<double>::infinity();
  double largest = std::numeric_limits<double>::infinity();  // in magnitude
  bool is_known = false;                                     // the schema contains the place

  bool allows(double value) const {
    return value > above && value >= from && value <= to && std::abs(value) <= largest;
  }
};

/// The scenario schema at one place of a scenario.
PlaceRule place_rule(std::span<const PathStep> steps);
/// The same by a path in the form of --set, without a scenario: a name may refer to any item of a list.
PlaceRule place_rule(std::string_view path);

// ---- Magnitudes ----

/// Limits on the magnitude of numbers in files, by their units. Beyond these limits simulations lose all accuracy, and
/// computations may not terminate. docs/formats/scenario.md states them.
struct Magnitudes {
  double largest = std::numeric_limits<double>::infinity();
  double smallest = 0;  // of numbers that must be greater than zero
};

/// Limits of a unit, written as in the schemas ("x-unit"). A place may state another limit ("x-largest").
Magnitudes magnitudes_of(std::string_view unit);

}  // namespace grapnel
