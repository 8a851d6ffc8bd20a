#pragma once

/// @file
/// Described values as JSON documents.

#include <nlohmann/json.hpp>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// Structures become objects whose keys are their fields' in the order of the description; fields that are not present
/// and empty optionals are left out, or null where the field says so. Enumerations become their names. Numbers that are
/// not finite stay in the document, which prints them as null.
nlohmann::ordered_json json_of(const Type& type, const void* value);
template <class T>
nlohmann::ordered_json json_of(const T& value) {
  return json_of(type_of<T>(), &value);
}

}  // namespace grapnel
