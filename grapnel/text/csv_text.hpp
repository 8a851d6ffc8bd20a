#pragma once

/// @file
/// Lines and fields of CSV files, with their places for messages. The readers of trajectories, of logs of efforts and
/// of measured logs share it; they give the fields their meaning.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel {

/// A field, without blanks around it and without enclosing quotes. A doubled quote inside quotes stays doubled.
struct CsvCell {
  std::string_view text;
  std::size_t begin = 0;  ///< of the text within its line [bytes]
};

struct CsvLine {
  std::string_view text;
  int number = 0;  ///< from 1
  std::vector<CsvCell> cells;
};

/// Whether a field may be in quotes, which are then no part of it.
enum class CsvQuotes { are_text, enclose };

/// Iterates over the lines of a text that outlives this object. Blank lines and comments (#) are skipped.
class CsvText {
 public:
  explicit CsvText(std::string_view text, char separator = ',', CsvQuotes quotes = CsvQuotes::are_text)
      : rest_(text), separator_(separator), quotes_(quotes) {}

  /// The next line with fields, valid until the next call; null at the end.
  const CsvLine* next();
  /// The comments before the first line with fields, at most 100, split behind their sign: one of them may be a header,
  /// as numpy.savetxt writes it.
  const std::vector<CsvLine>& comments() const { return comments_; }

 private:
  std::string_view rest_;
  char separator_;
  CsvQuotes quotes_;
  int number_ = 0;
  CsvLine line_;
  std::vector<CsvLine> comments_;
};

/// The location of a byte of a line. Columns count characters.
Mark mark_in(const CsvLine& line, std::size_t byte, const std::shared_ptr<const std::string>& source);

/// The character that separates the fields of the first line with fields: a comma, or else a semicolon or a tab where
/// the line has any.
char csv_separator(std::string_view text);

}  // namespace grapnel
