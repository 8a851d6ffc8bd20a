#pragma once

/// @file
/// What a user most likely did where text is no YAML. The parser notices late and in its own words; a look at brackets,
/// quotes and lines finds the place of the slip.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace grapnel {

/// A likely cause of a syntax error.
struct SyntaxSlip {
  std::size_t at = 0;  // in the text [bytes]
  std::string message;
};

/// The slip that explains why a parser failed in line `error_line` (from 0), or empty: then the parser's own message
/// must do. Only for text that has been refused, for what looks like a slip may be meant. Linear in the text's length.
std::optional<SyntaxSlip> likely_slip(std::string_view text, std::size_t error_line);

/// A key and its value, as they were meant.
struct KeyAndValue {
  std::string_view key, value;
};

/// The parts of "duration:20" and "duration = 20", which YAML takes for one text; empty for anything else.
std::optional<KeyAndValue> key_without_blank(std::string_view text);

/// "a key needs a colon and a blank after it: 'duration: 20'" for "duration:20" and "duration = 20", else empty.
std::string key_advice(std::string_view text);

}  // namespace grapnel
