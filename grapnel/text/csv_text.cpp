#include "grapnel/text/csv_text.hpp"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::size_t kMostComments = 100;

// The end of a quoted field that begins at `quote`: the place of its second quote, or the end of the line without one.
std::size_t closing_quote(std::string_view line, std::size_t quote) {
  for (std::size_t at = quote + 1; at < line.size(); ++at) {
    if (line[at] != '"') continue;
    if (at + 1 == line.size() || line[at + 1] != '"') return at;
    ++at;
  }
  return line.size();
}

void split(std::string_view line, std::size_t begin, char separator, CsvQuotes quotes, std::vector<CsvCell>& cells) {
  const std::string_view blanks = separator == '\t' ? " " : " \t";
  cells.clear();
  for (std::size_t at = begin;;) {
    const std::size_t first = std::min(line.find_first_not_of(blanks, at), line.size());
    const bool is_quoted = quotes == CsvQuotes::enclose && first < line.size() && line[first] == '"';
    const std::size_t quote = is_quoted ? closing_quote(line, first) : first;
    const std::size_t stop = std::min(line.find(separator, is_quoted ? quote : at), line.size());
    if (is_quoted && quote < line.size() && line.find_first_not_of(blanks, quote + 1) >= stop) {
      cells.push_back({line.substr(first + 1, quote - first - 1), first + 1});
    } else {
      const std::size_t from = std::min(first, stop);
      std::size_t end = stop;
      while (end > from && blanks.find(line[end - 1]) != std::string_view::npos) --end;
      cells.push_back({line.substr(from, end - from), from});
    }
    if (stop == line.size()) return;
    at = stop + 1;
  }
}

// Takes the first line of `rest`, without its end.
std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace

const CsvLine* CsvText::next() {
  while (!rest_.empty()) {
    const std::string_view text = take_line(rest_);
    ++number_;
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) continue;
    if (text[first] != '#') {
      line_.text = text, line_.number = number_;
      split(text, 0, separator_, quotes_, line_.cells);
      return &line_;
    }
    if (line_.number > 0 || comments_.size() >= kMostComments) continue;
    comments_.push_back({text, number_, {}});
    split(text, first + 1, separator_, quotes_, comments_.back().cells);
  }
  return nullptr;
}

Mark mark_in(const CsvLine& line, std::size_t byte, const std::shared_ptr<const std::string>& source) {
  const std::string_view before = line.text.substr(0, byte);
  const auto characters = std::count_if(before.begin(), before.end(),
                                        [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; });
  return {source, line.number, static_cast<int>(characters) + 1};
}

char csv_separator(std::string_view text) {
  CsvText lines(text);
  const CsvLine* line = lines.next();
  if (!line || line->text.find(',') != std::string_view::npos) return ',';
  const std::size_t other = line->text.find_first_of(";\t");
  return other == std::string_view::npos ? ',' : line->text[other];
}

}  // namespace grapnel
