#pragma once

/// @file
/// What a scalar of a file means. The rules are Grapnel's own: a text that YAML 1.1, YAML 1.2 and C would read as
/// different numbers is refused. Thread safety: free functions.

#include <optional>
#include <string>

#include "grapnel/scenario/node.hpp"

namespace grapnel {

/// The value of a plain decimal number, .inf, -.inf or .nan; empty for anything else.
std::optional<double> number_of(const Node& node);
/// The value of true or false; empty for anything else.
std::optional<bool> boolean_of(const Node& node);
/// Whether the node is text: quoted, or plain and neither number nor boolean.
bool is_text(const Node& node);

/// Whether two values look like one number with a decimal comma: "0,5", digits behind a comma without a blank. `place`
/// is where the second begins.
bool is_decimal_comma(const Node& whole, const Node& fraction, const Mark& place);

/// What the node is, for a message: "the text 'abc'", "a list", "a mapping", "empty".
std::string described(const Node& node);
/// Why a node is no number, to follow "must be a number": ", not the text 'abc'", "; '010' looks octal, write 10".
std::string why_no_number(const Node& node);

}  // namespace grapnel
