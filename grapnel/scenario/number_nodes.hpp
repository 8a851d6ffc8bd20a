#pragma once

/// @file
/// Numbers to and from values of a tree: a number, a list of numbers, or a mapping of numbers. Thread safety: free
/// functions.

#include <optional>
#include <span>
#include <vector>

#include "grapnel/scenario/node.hpp"

namespace grapnel {

/// A number as a scalar that reads back to the same bits.
Node number_node(double value, const Mark& mark = {});
Node list_node(std::span<const double> values, const Mark& mark = {});

/// The finite numbers of a value, in its order; empty if it is anything else.
std::optional<std::vector<double>> numbers_in(const Node& value);
/// A value of the same form with other numbers, and another mark.
Node with_numbers(Node form, std::span<const double> numbers, const Mark& mark);
/// What a number of such a value is called: "x", "y", "z" of a list of three, "0", "1" of another, its key of a
/// mapping; empty of a number alone.
std::string number_name(const Node& form, std::size_t index);

}  // namespace grapnel
