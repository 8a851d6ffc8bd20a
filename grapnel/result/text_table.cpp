#include "grapnel/result/text_table.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>
#include <string_view>

namespace grapnel {
namespace {

bool starts_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }

/// `text` cut to `width` columns, the last one an ellipsis if something is missing.
std::string shortened(const std::string& text, std::size_t width) {
  if (text_width(text) <= width) return text;
  std::string kept;
  std::size_t columns = 0;
  for (const char c : text) {
    if (starts_character(c) && ++columns == width) break;
    kept += c;
  }
  return kept + "…";
}

/// Shortened in the middle: related names often differ at their ends.
std::string shortened_inside(const std::string& text, std::size_t width) {
  const std::size_t all = text_width(text);
  if (all <= width) return text;
  const std::size_t front = width / 3, back = width - 1 - front;
  std::string begin, end;
  std::size_t column = 0;
  for (const char c : text) {
    if (starts_character(c)) ++column;
    if (column <= front) begin += c;
    if (column > all - back) end += c;
  }
  return begin + "…" + end;
}

/// Whether different texts remain different in their shortened cells.
bool tells_apart(const std::vector<std::string>& texts, const std::vector<std::string>& cells) {
  return std::set(texts.begin(), texts.end()).size() == std::set(cells.begin(), cells.end()).size();
}

/// The first column with at least `width` columns, wider if shortened names would not be unique.
std::vector<std::string> first_cells(const std::vector<std::string>& texts, std::size_t& width) {
  const auto cut = [&](const auto& shorten) {
    std::vector<std::string> cells;
    for (const std::string& text : texts) cells.push_back(shorten(text, width));
    return cells;
  };
  if (auto cells = cut(shortened); tells_apart(texts, cells)) return cells;
  for (;; ++width) {
    if (auto cells = cut(shortened_inside); tells_apart(texts, cells)) return cells;
  }
}

std::string padding(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text_width(text)), ' ');
}

}  // namespace

std::size_t text_width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), starts_character));
}

std::string short_number(double value) { return fmt::format("{:.5g}", value); }

std::string paragraph(std::string_view text, std::string_view indent) {
  std::string out;
  std::string line(indent);
  bool empty = true;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \n", begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) continue;
    if (!empty && text_width(line) + 1 + text_width(word) > kTextColumns) {
      out += line + "\n";
      line = indent;
      empty = true;
    }
    if (!empty) line += ' ';
    line += word;
    empty = false;
  }
  return out + line + "\n";
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], text_width(row[i]));
  }
  if (widths.empty()) return "";
  constexpr std::size_t kShortest = 8;
  const std::size_t total = std::accumulate(widths.begin(), widths.end(), 2 * widths.size());
  if (total > kTextColumns) {
    const std::size_t others = total - widths[0];
    widths[0] = std::max(kShortest, kTextColumns - std::min(kTextColumns, others));
  }
  std::vector<std::string> names;
  for (const auto& row : rows_) names.push_back(row.empty() ? "" : row[0]);
  names = first_cells(names, widths[0]);
  std::string out;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const std::vector<std::string>& row = rows_[r];
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string& cell = i == 0 ? names[r] : row[i];
      line += i < left_ ? "  " + cell + padding(cell, widths[i]) : "  " + padding(cell, widths[i]) + cell;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

namespace {

// A text that a spreadsheet would evaluate, or one that looks like an escaped text.
bool csv_is_formula(std::string_view text) {
  const std::size_t begin = text.find_first_not_of('\'');
  return begin != std::string_view::npos && std::string_view("=+-@\t\r").find(text[begin]) != std::string_view::npos;
}

}  // namespace

std::string csv_text_of(std::string_view field) {
  if (field.starts_with('\'') && csv_is_formula(field)) field.remove_prefix(1);
  return std::string(field);
}

std::string csv_quoted(const std::string& plain) {
  const std::string text = csv_is_formula(plain) ? "'" + plain : plain;
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + "\"";
}

void append_csv_number(double value, std::string& out) {
  if (!std::isfinite(value)) {
    out += std::isnan(value) ? "NaN" : value > 0 ? "Inf" : "-Inf";
    return;
  }
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  out.append(buffer, static_cast<std::size_t>(end - buffer));
}

}  // namespace grapnel
