#pragma once

/// @file
/// JSON Schemas of files from the descriptions of what they hold.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// A self-contained draft-7 schema of files that hold the structure. Structures within it are definitions by their
/// names. Units are "x-unit", magnitudes other than the unit's "x-largest", infinite numbers "x-infinity".
nlohmann::ordered_json schema_of(const Type& type, const std::string& title);

}  // namespace grapnel
