#pragma once

/// @file
/// Writes a tree as text: a YAML file for people, or a value on one line.

#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Block style; values that fit on one line use flow style. `comment` comes first, with "# " before each line; the
/// comment of every value precedes its line. Parsing the text gives the same tree: kinds, texts, keys and their order,
/// and the types of scalars.
std::string yaml_text(const Node& tree, const std::string& comment = {});

/// The value on one line, as "--set path=TEXT" takes it: 10, [1, 0, 0], {match: twist}, "a text with: signs".
std::string flow_text(const Node& node);

}  // namespace grapnel
