#pragma once

/// @file
/// Names of a row's numbers as a criterion writes them.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// One of the names that a pattern matches.
struct NameMatch {
  std::vector<std::string> stars;  // what each `*` stands for
  std::size_t index = 0;           // of the name
};

/// All names that a name with `*` as whole parts matches, in the order of what the stars stand for; of equal names the
/// first. Without a `*`: that name itself, or nothing.
std::vector<NameMatch> matching_names(std::string_view pattern, std::span<const std::string> names);

/// A name that a criterion's text begins with.
struct LeadingName {
  std::size_t length = 0;  // bytes of the text
  std::vector<NameMatch> matches;
};

/// How many bytes at the beginning of `text` a name without backquotes can have at most; 0 if none begins there.
std::size_t longest_name(std::string_view text);

/// The longest beginning of `text` that matches and ends where a name may end; empty if there is none.
std::optional<LeadingName> leading_name(std::string_view text, std::span<const std::string> names);

/// "; did you mean 'a/b'?" for a name that is not there, or nothing if none is near.
std::string near_name(std::string_view word, std::span<const std::string> names);

}  // namespace grapnel
