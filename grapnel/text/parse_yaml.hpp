#pragma once

/// @file
/// YAML text to a tree, by the parser's events, so that places, duplicate keys, depth and size are ours to check.

#include <optional>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Nesting beyond this is refused; no scenario comes near.
inline constexpr int kDeepest = 64;
/// More values than this, aliases expanded, are refused.
inline constexpr std::size_t kMostValues = 500'000;

/// Parses one document. `text` is what checked_text() returned. On failure empty, with a fault; marks carry `source`.
std::optional<Node> parse_document(const std::string& text, const std::shared_ptr<const std::string>& source,
                                   FaultList& faults);
/// Parses the value of an override; every mark is `mark`.
std::optional<Node> parse_value(const std::string& text, const Mark& mark, FaultList& faults);

}  // namespace grapnel
