#pragma once

/// @file
/// How large the numbers of a file may be, by their units. Beyond, nothing that is simulated keeps a digit, and a
/// computation may take for ever. docs/formats/scenario.md states them.

#include <limits>
#include <string_view>

namespace grapnel {

struct Magnitudes {
  double largest = std::numeric_limits<double>::infinity();
  double smallest = 0;  // of what must be greater than zero
};

/// Of a unit as the schemas write it ("x-unit"). A place with another limit says so there ("x-largest").
Magnitudes magnitudes_of(std::string_view unit);

}  // namespace grapnel
