#pragma once

/// @file
/// Fields of CSV files.

#include <string>
#include <string_view>

namespace grapnel {

/// A text as a field as RFC 4180 has it: quoted where it must be, quotes doubled. A text that begins with = + - @, a
/// tab or a carriage return, which a spreadsheet would compute or swallow, gets an apostrophe before it; so does one
/// that begins with apostrophes before such a character, so that csv_text_of() gives the text back.
std::string csv_quoted(const std::string& text);
/// The text of a field, quotes taken off already: without the apostrophe that csv_quoted() put before it.
std::string csv_text_of(std::string_view field);

/// Appends the shortest text that reads back to the same double; NaN, Inf and -Inf as MATLAB, pandas and C spell or
/// accept them.
void append_csv_number(double value, std::string& out);

}  // namespace grapnel
