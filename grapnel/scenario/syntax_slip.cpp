#include "grapnel/scenario/syntax_slip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "grapnel/scenario/spelling.hpp"
#include "grapnel/scenario/text_scan.hpp"

namespace grapnel {
namespace {

// Keys or list items that stand one below the other.
struct Level {
  std::size_t indent;
  bool is_list;
  std::size_t line;  // the last one of them, from 0
};

// Follows the indentation from line to line.
class Levels {
 public:
  // What is wrong with the line's indentation, or nothing.
  std::string take(const BlockLine& line) {
    if (!line.is_key && line.dashes.empty()) return was_open_ = false, std::string();
    const bool is_item = !line.dashes.empty();
    const std::optional<Level> deeper = leave(line.indent);
    const std::string fault = place(line, is_item, deeper);
    for (std::size_t i = 1; i < line.dashes.size(); ++i) levels_.push_back({line.dashes[i], true, line.number});
    if (is_item && line.is_key) levels_.push_back({line.column, false, line.number});
    was_open_ = line.is_open;
    return fault;
  }

 private:
  // Leaves all levels deeper than the indentation; the last of them.
  std::optional<Level> leave(std::size_t indent) {
    std::optional<Level> last;
    while (!levels_.empty() && levels_.back().indent > indent) last = levels_.back(), levels_.pop_back();
    return last;
  }

  std::string place(const BlockLine& line, bool is_item, const std::optional<Level>& deeper) {
    const std::size_t n = line.indent;
    std::string fault;
    if (levels_.empty() || levels_.back().indent < n) {
      if (deeper) {
        fault = fits_nothing(n, is_item, *deeper);
      } else if (!levels_.empty() && !was_open_) {
        const Level& above = levels_.back();
        fault =
            fmt::format("this line is indented by {}, its neighbour in line {} by {}", n, above.line + 1, above.indent);
      }
      levels_.push_back({n, is_item, line.number});
      return fault;
    }
    if (is_item && !levels_.back().is_list) {
      if (!was_open_) fault = fmt::format("a list item among keys; line {} begins with a key", levels_.back().line + 1);
      levels_.push_back({n, true, line.number});
    } else if (!is_item && levels_.back().is_list) {
      const Level list = levels_.back();
      levels_.pop_back();
      if (levels_.empty() || levels_.back().indent < n) {
        fault = fmt::format(
            "a key among list items; indent it as the keys of the item in line {}, or begin an item "
            "with '- '",
            list.line + 1);
        levels_.push_back(list);
      }
    }
    levels_.back().line = line.number;
    return fault;
  }

  // A key can only join keys; an item may join either.
  std::string fits_nothing(std::size_t n, bool is_item, const Level& deeper) const {
    std::string above;
    for (auto level = levels_.rbegin(); level != levels_.rend() && above.empty(); ++level) {
      if (is_item || !level->is_list) above = fmt::format("line {} has {}, ", level->line + 1, level->indent);
    }
    return fmt::format("this line is indented by {}, which fits no line above: {}line {} has {}", n, above,
                       deeper.line + 1, deeper.indent);
  }

  std::vector<Level> levels_;
  bool was_open_ = true;
};

// A line that is no "key: value" where one must be.
std::string fault_of_words(const BlockLine& line) {
  if (const std::string advice = key_advice(line.words); !advice.empty()) return advice;
  return line.dashes.empty() ? "this line is no 'key: value'; is a colon missing?" : "";
}

// "-name: ball", "-{name: ball}"; "-1" is a number.
bool lacks_blank_behind_dash(std::string_view text) {
  if (text.size() < 2 || text[0] != '-') return false;
  const char c = text[1];
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '{' || c == '[' || c == '"' || c == '\'';
}

// The slip in the shape of the line where the parser failed, or of the one before it: a line without a colon becomes
// part of a text, and the parser fails at the next one.
std::optional<SyntaxSlip> slip_of_lines(std::string_view text, const std::vector<BlockLine>& lines,
                                        std::size_t error_line, std::size_t& at) {
  Levels levels;
  for (std::size_t i = 0; i < lines.size() && lines[i].number <= error_line; ++i) {
    const BlockLine& line = lines[i];
    const bool fails_here = line.number == error_line;
    const bool fails_next = i + 1 < lines.size() && lines[i + 1].number == error_line;
    std::string fault = levels.take(line);
    std::size_t place = line.begin + line.indent;
    if (!fails_here && !fails_next) continue;
    if (lacks_blank_behind_dash(text.substr(place))) fault = "a '-' that begins a list item needs a blank after it";
    if (fault.empty() && line.is_plain) fault = fault_of_words(line), place = line.begin + line.column;
    if (fault.empty() && fails_here && !line.second_key.empty()) {
      fault = "a second ': ' in one line; put a text that holds it in quotes, or begin a new line for a new key";
      place = line.value;
    }
    if (fault.empty()) continue;
    at = line.number;
    return SyntaxSlip{place, fault};
  }
  return {};
}

}  // namespace

std::optional<KeyAndValue> key_without_blank(std::string_view text) {
  const auto is_name = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  std::size_t end = 0;
  while (end < text.size() && is_name(text[end])) ++end;
  const std::size_t sign = std::min(text.find_first_not_of(' ', end), text.size());
  if (end == 0 || (text[0] >= '0' && text[0] <= '9') || sign == text.size()) return {};
  if (text[sign] != '=' && !(text[sign] == ':' && sign == end)) return {};
  std::size_t value = std::min(text.find_first_not_of(' ', sign + 1), text.size());
  if (text.substr(value).starts_with("\u00a0")) value += 2;  // a blank that YAML takes for a letter
  // "http://…" is no key, nor is "a == b".
  if (value >= text.size() || std::string_view("/\\=:").find(text[value]) != std::string_view::npos) return {};
  return KeyAndValue{text.substr(0, end), text.substr(value)};
}

std::string key_advice(std::string_view text) {
  const auto meant = key_without_blank(text);
  if (!meant) return {};
  return "a key needs a colon and a blank after it: " +
         in_quotes(std::string(meant->key) + ": " + std::string(meant->value));
}

std::optional<SyntaxSlip> likely_slip(std::string_view text, std::size_t error_line) {
  const TextScan scan = scan_text(text);
  std::size_t line = 0;
  const auto of_lines = slip_of_lines(text, scan.lines, error_line, line);
  const bool scanned = scan.slip && scan.slip_line <= error_line;
  if (of_lines && (!scanned || line < scan.slip_line)) return of_lines;
  return scanned ? scan.slip : std::nullopt;
}

}  // namespace grapnel
