#pragma once

/// @file
/// Words and names for messages: text from files as a terminal may show it, what a user may have meant, names quoted on
/// one line. Names, messages and tables come from files that anyone may have written; a terminal obeys control
/// characters in them. Commands that a reader copies into a shell.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

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

/// As HTML and XML have it, between tags and in quoted attributes.
std::string escaped_markup(std::string_view text);

// Commands that a reader copies into a shell.

/// A word as a shell reads it back: quoted where it must be.
std::string shell_word(const std::string& text);

}  // namespace grapnel
