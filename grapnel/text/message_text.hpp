#pragma once

/// @file
/// Text for messages: printable text from files, suggestions for misspelt names, quoted names on one line, and shell
/// commands. Names, messages and tables come from untrusted files; a terminal would execute control characters in them.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// Length of the UTF-8 character that starts at text[i], 0 if it is invalid (RFC 3629: no overlong forms, no
/// surrogates).
std::size_t utf8_length(std::string_view text, std::size_t i);

/// Whether the character that starts at text[i], of this length, is a control character: C0 (with tab and the ends of
/// lines), DEL, C1, the ends of lines and paragraphs of Unicode, or one that changes the direction of writing.
bool is_control(std::string_view text, std::size_t i, std::size_t length);

/// The text with '?' for every control character and for every byte that is not UTF-8, so that it is one line.
std::string printable_line(std::string_view text);
/// The same, with line feeds and tabs.
std::string printable_lines(std::string_view text);

/// The candidate nearest to `word`, within one or two typing errors or a change of case, else empty.
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

/// The text, truncated to 60 characters, so that messages remain readable for any input.
std::string shortened(std::string_view text);

/// Escapes text for HTML and XML, between tags and in quoted attributes.
std::string escaped_markup(std::string_view text);

// Commands for a shell.

/// A word for a shell, quoted if necessary.
std::string shell_word(const std::string& text);

}  // namespace grapnel
