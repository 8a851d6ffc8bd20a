#pragma once

/// @file
/// Plain-text tables and paragraphs that fit a terminal, and fields of CSV files.

#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

inline constexpr std::size_t kTextColumns = 100;

/// Columns on a terminal that `text` (UTF-8, no wide characters) takes.
std::size_t text_width(std::string_view text);

/// `text` broken at spaces into lines of at most kTextColumns, each behind `indent`, and a newline at the end.
std::string paragraph(std::string_view text, std::string_view indent);

/// Five significant digits.
std::string short_number(double value);

/// Rows of cells; all but the leading `left` columns are aligned to the right.
class TextTable {
 public:
  explicit TextTable(std::size_t left = 1) : left_(left) {}
  void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// Two spaces before each row and between columns; the first column is cut short (with an ellipsis) where a row would
  /// pass kTextColumns.
  std::string text() const;

 private:
  std::size_t left_;
  std::vector<std::vector<std::string>> rows_;
};

// Fields of CSV files.

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
