#pragma once

/// @file
/// Converts YAML text to a tree from the parser's events, with checks of locations, duplicate keys, depth and size.

#include <optional>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Limit on nesting, far above that of any scenario.
inline constexpr int kDeepest = 64;
/// Limit on the number of values, aliases expanded.
inline constexpr std::size_t kMostValues = 500'000;

/// Parses one document. `text` is the result of checked_text(). On failure empty, with an error; marks contain
/// `source`.
std::optional<Node> parse_document(const std::string& text, const std::shared_ptr<const std::string>& source,
                                   FaultList& faults);
/// Parses the value of an override; every mark is `mark`.
std::optional<Node> parse_value(const std::string& text, const Mark& mark, FaultList& faults);

}  // namespace grapnel
