#pragma once

/// @file
/// Text from files as a terminal may show it. Names, messages and tables come from files that anyone may have written;
/// a terminal obeys control characters in them. Thread safety: pure functions.

#include <cstddef>
#include <string>
#include <string_view>

namespace grapnel {

/// Length of the UTF-8 character that starts at text[i], 0 if there is none (RFC 3629: no overlong forms, no
/// surrogates).
std::size_t utf8_length(std::string_view text, std::size_t i);

/// Whether the character that starts at text[i], of this length, is a control character: C0 (with tab and the ends of
/// lines), DEL, C1, the ends of lines and paragraphs of Unicode, or one that turns the direction of writing.
bool is_control(std::string_view text, std::size_t i, std::size_t length);

/// The text with '?' for every control character and for every byte that is no UTF-8, so that it is one line.
std::string printable_line(std::string_view text);
/// The same, but line feeds and tabs stay.
std::string printable_lines(std::string_view text);

}  // namespace grapnel
