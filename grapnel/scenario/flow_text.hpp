#pragma once

/// @file
/// A tree back to text. Thread safety: a free function.

#include <string>

#include "grapnel/scenario/node.hpp"

namespace grapnel {

/// The value on one line, as "--set path=TEXT" takes it: 10, [1, 0, 0], {match: twist}, "a text with: signs".
std::string flow_text(const Node& node);

}  // namespace grapnel
