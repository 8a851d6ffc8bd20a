#pragma once

/// @file
/// Words for messages: what the user may have meant, and names quoted on one line. Thread safety: free functions.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// The candidate nearest to `word`, or empty if none is near: a typing error or two, or another case.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean 'x'?" if a candidate is near, else "; allowed are a, b, c" (with `kind` before: "; joints are …").
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates,
                       std::string_view kind = "allowed");

/// The text in quotes on one line, shortened to 40 characters.
std::string in_quotes(std::string_view text);

/// "a, b, c": at most 20 of the names, each shortened.
std::string some_of(const std::vector<std::string>& names);

/// "1 item", "3 items".
std::string counted(std::size_t count, std::string_view thing);

/// The text, cut at 60 characters, so that a message stays readable whatever a file holds.
std::string shortened(std::string_view text);

}  // namespace grapnel
