#pragma once

/// @file
/// JSON documents as text that people read and programs compare. Inside this module only.

#include <nlohmann/json.hpp>
#include <string>

namespace grapnel {

/// Objects, and lists that hold objects or lists, are spread over lines; lists of numbers or names stay on one. Numbers
/// read back to the same double, NaN and infinities become null, bytes that are not UTF-8 U+FFFD. A newline at the end.
std::string json_text(const nlohmann::ordered_json& document);

}  // namespace grapnel
