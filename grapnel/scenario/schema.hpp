#pragma once

/// @file
/// The published JSON Schemas, the check of a document against them, and what they say of one place. They are the one
/// place that says which keys there are, their types, ranges and defaults; those of scenarios and robots follow from
/// the descriptions (sections.hpp).

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
/// Of a ready-made target: what a scenario says of one, but for its state, which is the scenario's.
const nlohmann::ordered_json& target_schema_document();

/// Checks the structure: keys, types, lengths, ranges, choices. `document` names the whole in messages ("the
/// scenario"); `path` leads to it where it is part of a larger whole. A misspelt key is reported and gets the name that
/// was meant, so that what it holds is checked too and nothing misses it.
void check_structure(Node& node, const nlohmann::ordered_json& schema, const std::string& document, FaultList& faults,
                     const std::string& path = {});

/// The schema as it is published: where numbers have a unit, texts such as "30 deg" are allowed.
std::string published(nlohmann::ordered_json schema);

/// Adds what is absent and has a default, so that readers need none of their own.
void fill_defaults(Node& node, const nlohmann::ordered_json& schema);

// ---- Places ----

/// Unit and range of the number, or of every number of the list, that may stand at a place.
struct PlaceRule {
  std::string unit;  // empty: none is stated
  std::string description;
  double above = -std::numeric_limits<double>::infinity();  // the number must be greater
  double from = -std::numeric_limits<double>::infinity(), to = std::numeric_limits<double>::infinity();
  double largest = std::numeric_limits<double>::infinity();  // in magnitude
  bool is_known = false;                                     // the schema has such a place

  bool allows(double value) const {
    return value > above && value >= from && value <= to && std::abs(value) <= largest;
  }
};

/// What the scenario's schema says about one place of a scenario.
PlaceRule place_rule(std::span<const PathStep> steps);
/// The same by a path as --set has it, without a scenario: whichever item of a list a name may mean.
PlaceRule place_rule(std::string_view path);

// ---- Magnitudes ----

/// How large the numbers of a file may be, by their units. Beyond, nothing that is simulated keeps a digit, and a
/// computation may take for ever. docs/formats/scenario.md states them.
struct Magnitudes {
  double largest = std::numeric_limits<double>::infinity();
  double smallest = 0;  // of what must be greater than zero
};

/// Of a unit as the schemas write it ("x-unit"). A place with another limit says so there ("x-largest").
Magnitudes magnitudes_of(std::string_view unit);

}  // namespace grapnel
