#pragma once

/// @file
/// A rough look at YAML text that a parser has refused: brackets, quotes, comments and the shape of lines, enough to
/// say where a slip is. Thread safety: free functions.

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "grapnel/scenario/syntax_slip.hpp"

namespace grapnel {

/// A line that begins outside brackets, quotes and block texts. Blank lines and comments are none. Offsets in bytes.
struct BlockLine {
  std::size_t number = 0;           // of the line, from 0
  std::size_t begin = 0;            // of the line in the text
  std::size_t indent = 0;           // blanks before what it holds
  std::vector<std::size_t> dashes;  // columns of "- " that begin items
  std::size_t column = 0;           // of what follows them, or of the first character
  bool is_key = false;              // begins with "key:", after any dashes
  bool is_open = false;             // the value is to follow: "key:" or "-" and no more
  bool is_plain = false;            // words without a key, brackets or quotes
  std::string_view words;           // of a plain line
  std::size_t value = 0;            // is_key: where its value begins in the text
  std::string_view second_key;      // is_key: a plain value up to ": " within it, which YAML does not allow
};

struct TextScan {
  std::vector<BlockLine> lines;
  /// The first slip among brackets, quotes and marks that no YAML has; the scan ends there.
  std::optional<SyntaxSlip> slip;
  std::size_t slip_line = 0;  // from 0
};

TextScan scan_text(std::string_view text);

/// Whether the text begins with "name:" and a blank or the line's end.
bool begins_with_key(std::string_view line);

}  // namespace grapnel
