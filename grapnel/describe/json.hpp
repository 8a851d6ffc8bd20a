#pragma once

/// @file
/// Described values as JSON documents.

#include <nlohmann/json.hpp>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// Structures become objects whose keys are their fields' in the order of the description; absent fields and empty
/// optionals are omitted, or null if the field requires it. Enumerations become their names. Non-finite numbers remain
/// in the document, which prints them as null.
nlohmann::ordered_json json_of(const Type& type, const void* value);
template <class T>
nlohmann::ordered_json json_of(const T& value) {
  return json_of(type_of<T>(), &value);
}

}  // namespace grapnel
