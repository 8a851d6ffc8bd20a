#pragma once

/// @file
/// A tree back to text: a YAML file that people read and change, or a value on one line.

#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Block style, with what fits on one line in flow style. `comment` comes first, "# " before each of its lines, and so
/// does the comment of every value before the line on which it begins. Parsed again the tree is the same: kinds, texts,
/// keys and their order, and what is a number, a truth value or text.
std::string yaml_text(const Node& tree, const std::string& comment = {});

/// The value on one line, as "--set path=TEXT" takes it: 10, [1, 0, 0], {match: twist}, "a text with: signs".
std::string flow_text(const Node& node);

}  // namespace grapnel
