#pragma once

/// @file
/// The likely cause of invalid YAML. The parser reports errors late and in general terms; a check of brackets,
/// quotes and lines finds their position.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace grapnel {

/// A likely cause of a syntax error.
struct SyntaxMistake {
  std::size_t at = 0;  // in the text [bytes]
  std::string message;
};

/// The likely cause of a parser error in line `error_line` (from 0), or empty: then the parser's message is used. Only
/// for rejected text, because similar valid text may be intended. Linear in the text's length.
std::optional<SyntaxMistake> likely_slip(std::string_view text, std::size_t error_line);

/// An intended key and its value.
struct KeyAndValue {
  std::string_view key, value;
};

/// The parts of "duration:20" and "duration = 20", which YAML reads as one string; else empty.
std::optional<KeyAndValue> key_without_blank(std::string_view text);

/// "a key needs a colon and a blank after it: 'duration: 20'" for "duration:20" and "duration = 20", else empty.
std::string key_advice(std::string_view text);

}  // namespace grapnel
