#pragma once

/// @file
/// Plain-text tables and paragraphs that fit a terminal.

#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

inline constexpr std::size_t kTextColumns = 100;

/// Columns on a terminal that `text` (UTF-8, no wide characters) takes.
std::size_t text_width(std::string_view text);

/// `text` broken at spaces into lines of at most kTextColumns, each behind `indent`, and a newline at the end.
std::string paragraph(std::string_view text, std::string_view indent);

/// Five significant digits: what fits a table for people.
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

}  // namespace grapnel
