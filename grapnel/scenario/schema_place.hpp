#pragma once

/// @file
/// What the scenario's schema says about one place of a scenario.

#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "grapnel/text/yaml_paths.hpp"

namespace grapnel {

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

PlaceRule place_rule(std::span<const PathStep> steps);

}  // namespace grapnel
