#pragma once

/// @file
/// Interpretation of the scalars of a file, and conversion between numbers and values of a tree. The rules are stricter
/// than YAML: a text that YAML 1.1, YAML 1.2 and C would read as different numbers is rejected.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Correction for the text of a number, after "not the text '10,5'": "; use a decimal point, write 10.5". For decimal
/// commas, thousands separators, units, degrees, products with pi, and single wrong letters. Else empty.
std::string number_advice(std::string_view text);

/// "; write a list in brackets: [1, 1, 1]" for "1, 1, 1", "1 1 1" and "(1, 1, 1)". Else empty.
std::string list_advice(std::string_view text);

/// The value of a plain decimal number, .inf, -.inf or .nan; empty for anything else.
std::optional<double> number_of(const Node& node);
/// The value of true or false; empty for anything else.
std::optional<bool> boolean_of(const Node& node);
/// Whether the node is text: quoted, or plain and neither number nor boolean.
bool is_text(const Node& node);

/// Whether two values look like one number with a decimal comma: "0,5", digits behind a comma without a blank. `place`
/// is where the second begins.
bool is_decimal_comma(const Node& whole, const Node& fraction, const Mark& place);

/// Description of the node for a message: "the text 'abc'", "a list", "a mapping", "empty".
std::string described(const Node& node);
/// Why a node is not a number, after "must be a number": ", not the text 'abc'", "; '010' looks octal, write 10".
std::string why_no_number(const Node& node);

// Construction of trees.

/// A number as a scalar that reads back to the same bits.
Node number_node(double value, const Mark& mark = {});
Node list_node(std::span<const double> values, const Mark& mark = {});
/// A text, in quotes if it would read as something else.
Node text_node(const std::string& text, const Mark& mark = {});
Node mapping_node(const Mark& mark = {});
Node sequence_node(const Mark& mark = {});
/// Sets a key of a mapping.
void put(Node& mapping, std::string_view key, Node value);

/// The finite numbers of a value, in its order; else empty.
std::optional<std::vector<double>> numbers_in(const Node& value);
/// A value of the same form with other numbers, and another mark.
Node with_numbers(Node form, std::span<const double> numbers, const Mark& mark);
/// The name of a number of such a value: "x", "y", "z" in a list of three, "0", "1" in another list, the key in a
/// mapping; empty for a single number.
std::string number_name(const Node& form, std::size_t index);

}  // namespace grapnel
