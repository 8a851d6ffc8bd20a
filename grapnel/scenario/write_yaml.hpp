#pragma once

/// @file
/// A tree to a YAML file that people read and change. Thread safety: a free function.

#include <string>

#include "grapnel/scenario/node.hpp"

namespace grapnel {

/// Block style, with what fits on one line in flow style. `comment` comes first, "# " before each of its lines. Parsed
/// again the tree is the same: kinds, texts, keys and their order, and what is a number, a truth value or text.
std::string yaml_text(const Node& tree, const std::string& comment = {});

}  // namespace grapnel
