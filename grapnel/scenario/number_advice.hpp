#pragma once

/// @file
/// What a text that should be a number may have been meant to say. Thread safety: free functions.

#include <string>
#include <string_view>

namespace grapnel {

/// What to write in place of the text of a number, to follow "not the text '10,5'": "; numbers have a point, write
/// 10.5". For decimal commas, separators of thousands, units, degrees, products with pi, slips of one letter. Else
/// empty.
std::string number_advice(std::string_view text);

/// "; a list stands in brackets: [1, 1, 1]" for "1, 1, 1", "1 1 1" and "(1, 1, 1)". Else empty.
std::string list_advice(std::string_view text);

}  // namespace grapnel
