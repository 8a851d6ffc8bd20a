#include "grapnel/text/syntax_mistake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// A line that begins outside brackets, quotes and block texts. Blank lines and comments are none. Offsets in bytes.
struct BlockLine {
  std::size_t number = 0;           // of the line, from 0
  std::size_t begin = 0;            // of the line in the text
  std::size_t indent = 0;           // blanks before what it holds
  std::vector<std::size_t> dashes;  // columns of "- " that begin items
  std::size_t column = 0;           // of what follows them, or of the first character
  bool is_key = false;              // begins with "key:", after any dashes
  bool is_open = false;             // the value is to follow: "key:" or "-" and no more
  bool is_plain = false;            // words without a key, brackets or quotes
  std::string_view words;           // of a plain line
  std::size_t value = 0;            // is_key: where its value begins in the text
  std::string_view second_key;      // is_key: a plain value up to ": " within it, which YAML does not allow
};

struct TextScan {
  std::vector<BlockLine> lines;
  // The first error among brackets, quotes and characters that are not YAML; the scan ends there.
  std::optional<SyntaxMistake> slip;
  std::size_t slip_line = 0;  // from 0
};

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

// Whether the text begins with "name:" and a blank or the line's end.
bool begins_with_key(std::string_view line) {
  const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  std::size_t end = first;
  while (end < line.size() && is_word(line[end])) ++end;
  return end > first && end < line.size() && line[end] == ':' && (end + 1 == line.size() || is_blank(line[end + 1]));
}

constexpr std::size_t kMostOpen = 1000;

struct Bracket {
  char mark;
  std::size_t at;
  std::size_t line;
  bool in_value = false;  // of an entry "key: value" within braces
};

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  TextScan scan() {
    while (at_ < text_.size() && !scan_.slip) read_line();
    return std::move(scan_);
  }

 private:
  char here() const { return at_ < text_.size() ? text_[at_] : '\n'; }
  char next() const { return at_ + 1 < text_.size() ? text_[at_ + 1] : '\n'; }
  bool ends_word(char c) const { return is_blank(c) || c == '\n'; }
  bool at_line_end() const { return here() == '\n'; }
  // The rest of the line that begins at a place.
  std::string_view rest(std::size_t from) const { return text_.substr(from, text_.find('\n', from) - from); }
  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }
  void skip_line() {
    at_ = std::min(text_.find('\n', at_), text_.size());
    if (at_ < text_.size()) ++at_;
    ++line_;
  }
  bool at_comment() const { return here() == '#' && (at_ == 0 || ends_word(text_[at_ - 1])); }
  void fail(std::size_t at, std::size_t line, std::string message) {
    if (scan_.slip) return;
    scan_.slip = SyntaxMistake{at, std::move(message)};
    scan_.slip_line = line;
  }
  static std::string in_line(std::size_t line) { return fmt::format(" in line {}", line + 1); }

  // Line starts that are not YAML.
  bool is_foreign(std::size_t begin) {
    const std::string_view line = rest(begin);
    for (const char* mark : {"<<<<<<<", "=======", ">>>>>>>"}) {
      if (line.starts_with(mark) && (line.size() == 7 || is_blank(line[7]))) {
        fail(begin, line_, "the mark of an unresolved merge conflict; keep one of the two sides and remove the marks");
        return true;
      }
    }
    const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
    if (line.substr(first).starts_with("//") || line.substr(first).starts_with("/*")) {
      fail(begin + first, line_, fmt::format("'{}' begins no comment; comments begin with '#'", line.substr(first, 2)));
      return true;
    }
    return false;
  }

  void read_line() {
    const std::size_t begin = at_;
    if (is_foreign(begin)) return;
    skip_blanks();
    const std::string_view line = rest(begin);
    if (at_line_end() || at_comment() || line.starts_with("---") || line.starts_with("...") || line.starts_with('%')) {
      return skip_line();
    }
    BlockLine block;
    block.number = line_, block.begin = begin, block.indent = block.column = at_ - begin;
    if (continues_words(block.indent)) return skip_line();
    while (here() == '-' && ends_word(next())) {
      block.dashes.push_back(at_ - begin);
      ++at_;
      skip_blanks();
    }
    block.column = at_ - begin;
    scan_.lines.push_back(block);
    read_content();
    skip_line();
  }

  // A continuation line of a text without quotes: deeper than its key and without a key.
  bool continues_words(std::size_t indent) const {
    if (!ends_in_words_ || scan_.lines.empty() || indent <= scan_.lines.back().column) return false;
    const std::string_view line = rest(at_);
    return line.find(": ") == std::string_view::npos && !line.ends_with(':');
  }

  // Keys and values until the line ends, or the line in which a bracket or quote of this one ends.
  void read_content() {
    ends_in_words_ = false;
    bool key = false, value = false;  // met so far
    while (!scan_.slip) {
      skip_blanks();
      if (at_line_end() || at_comment()) break;
      const char c = here();
      if ((c == '&' || c == '*' || c == '!') && !ends_word(next())) {
        while (!ends_word(here())) ++at_;
        value = value || c == '*';
        continue;
      }
      if (key && !value) current().value = at_;
      if ((c == '|' || c == '>') && !value) return skip_block_text();
      value = true;
      const std::size_t began = at_;
      if (c == '@' || c == '`' || c == '%')
        return fail(at_, line_, fmt::format("a text that begins with '{}' needs quotes", c));
      const bool plain = c != '"' && c != '\'' && c != '[' && c != '{' && c != ']' && c != '}';
      if (plain)
        read_words();
      else if (c == '"' || c == '\'')
        read_quote();
      else if (c == '[' || c == '{')
        read_brackets();
      else
        fail(at_, line_, fmt::format("'{}' closes nothing; no '{}' is open", c, c == ']' ? '[' : '{'));
      if (scan_.slip) return;
      const std::size_t ended = at_;
      skip_blanks();
      if (here() == ':' && ends_word(next())) {
        if (key && plain) {
          current().second_key = text_.substr(began, ended - began);
          return;
        }
        ++at_;
        key = true, value = false;
        current().is_key = true;
      } else if (!plain && !at_line_end() && !at_comment()) {
        fail_behind(c);
      } else if (plain) {
        ends_in_words_ = true;
        if (!key) current().is_plain = true, current().words = text_.substr(began, ended - began);
      }
    }
    current().is_open = !value;
  }

  BlockLine& current() { return scan_.lines.back(); }

  // A value in quotes or brackets has ended and more follows in its line.
  void fail_behind(char opened) {
    if (here() == ']' || here() == '}') {
      fail(at_, line_, fmt::format("'{}' closes nothing; no '{}' is open", here(), here() == ']' ? '[' : '{'));
    } else if (opened == '"') {
      fail(at_, line_, "text after the closing quote; a quote within the text is written \\\"");
    } else if (opened == '\'') {
      fail(at_, line_, "text after the closing quote; a quote within the text is written ''");
    } else {
      fail(at_, line_,
           fmt::format("text after the closing '{}'; is a comma or a bracket missing?", opened == '[' ? ']' : '}'));
    }
  }

  // Words without quotes end with ": ", " #" or the line.
  void read_words() {
    std::size_t end = at_;
    while (!at_line_end() && !(here() == ':' && ends_word(next())) && !at_comment()) {
      if (!is_blank(here())) end = at_ + 1;
      ++at_;
    }
    at_ = end;
  }

  // The lines after "|" or ">" that are indented deeper than the key.
  void skip_block_text() {
    const std::size_t least = current().dashes.empty() ? current().indent : current().dashes.back();
    current().is_open = false;
    while (at_ < text_.size() && !at_line_end()) ++at_;
    while (at_ + 1 < text_.size()) {
      const std::string_view line = rest(at_ + 1);
      const std::size_t first = line.find_first_not_of(" \t\r");
      if (first != std::string_view::npos && first <= least) return;
      at_ += 1 + line.size(), ++line_;
    }
  }

  void read_quote() {
    const std::size_t opened = at_, opened_line = line_;
    const char quote = here();
    for (++at_; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n') {
        ++line_;
        const std::string_view line = rest(at_ + 1);
        if (begins_with_key(line)) {
          return fail(opened, opened_line,
                      fmt::format("this quote is not closed; line {} begins with a key", line_ + 1));
        }
      } else if ((c == '\\' && quote == '"') || (c == quote && quote == '\'' && next() == quote)) {
        ++at_;
        if (here() == '\n') ++line_;
      } else if (c == quote) {
        ++at_;
        return;
      }
    }
    fail(opened, opened_line, "this quote is not closed");
  }

  // From an opening bracket to the one that closes it, over as many lines as it takes.
  void read_brackets() {
    std::vector<Bracket> open;
    const std::size_t deepest_key = indentation_of_keys();
    bool start = true;         // a value may begin here
    bool after_value = false;  // a value in quotes or brackets has just ended
    do {
      const char c = here();
      if (at_ >= text_.size()) {
        return fail(open.back().at, open.back().line, fmt::format("this '{}' is not closed", open.back().mark));
      }
      if (c == '\n') {
        ++at_, ++line_;
        if (is_foreign(at_) || fails_at_line(open.back(), deepest_key)) return;
      } else if (is_blank(c)) {
        ++at_;
      } else if (at_comment()) {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else if (c == ']' || c == '}') {
        if (!close(open)) return;
        start = false, after_value = true;
      } else if (c == ',' || (c == ':' && (after_value || ends_word(next()) || next() == ','))) {
        if (!open.empty()) open.back().in_value = c == ':';
        ++at_;
        start = true, after_value = false;
      } else if (after_value) {
        return fail(at_, line_, "a comma is missing before this");
      } else if (c == '[' || c == '{') {
        if (open.size() == kMostOpen) return give_up();
        open.push_back({c, at_++, line_});
        start = true;
      } else if ((c == '"' || c == '\'') && start) {
        read_quote();
        if (scan_.slip) return;
        start = false, after_value = true;
      } else if (!read_words_in_brackets(open.back(), start)) {
        return;
      }
    } while (!open.empty());
  }

  // So deep that no slip explains it.
  void give_up() { at_ = text_.size(); }

  // Keys of the lines around a bracket stand no deeper than this; without such a line, anything may follow.
  std::size_t indentation_of_keys() {
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    const BlockLine& line = current();
    if (line.is_key) return line.column;
    return line.dashes.empty() ? kNone : line.dashes.back();
  }

  // Whether the line that begins here shows that a bracket should have been closed before.
  bool fails_at_line(const Bracket& innermost, std::size_t deepest_key) {
    if (deepest_key == std::numeric_limits<std::size_t>::max()) return false;
    std::string_view line = rest(at_);
    const std::size_t indent = line.find_first_not_of(' ');
    if (indent == std::string_view::npos || indent > deepest_key) return false;
    line.remove_prefix(indent);
    if (!line.starts_with("- ") && !begins_with_key(line)) return false;
    fail(innermost.at, innermost.line,
         fmt::format("this '{}' is not closed; line {} begins something new", innermost.mark, line_ + 1));
    return true;
  }

  bool close(std::vector<Bracket>& open) {
    const char c = here();
    const char wanted = c == ']' ? '[' : '{';
    const Bracket& innermost = open.back();
    if (innermost.mark == wanted) {
      open.pop_back();
      ++at_;
      return true;
    }
    // Further out it has its partner: then what stands between was left open.
    if (std::any_of(open.begin(), open.end(), [&](const Bracket& b) { return b.mark == wanted; })) {
      fail(innermost.at, innermost.line,
           fmt::format("this '{}' is not closed before the '{}'{}", innermost.mark, c,
                       innermost.line == line_ ? "" : in_line(line_)));
    } else {
      fail(at_, line_,
           fmt::format("'{}' cannot close the '{}'{}; write '{}'", c, innermost.mark,
                       innermost.line == line_ ? "" : in_line(innermost.line), innermost.mark == '[' ? ']' : '}'));
    }
    return false;
  }

  bool read_words_in_brackets(const Bracket& innermost, bool& start) {
    const std::size_t began = at_;
    start = false;
    while (at_ < text_.size() && !at_line_end() && std::string_view(",[]{}").find(here()) == std::string_view::npos &&
           !(here() == ':' && (ends_word(next()) || next() == ',')) && !at_comment()) {
      ++at_;
    }
    // An anchor or a tag stands before the value.
    if (text_[began] == '&' || text_[began] == '!') {
      at_ = began;
      while (at_ < text_.size() && !ends_word(here()) && here() != ',') ++at_;
      start = true;
      return true;
    }
    if (here() != ':' || !innermost.in_value) return true;
    fail(began, line_, "a second ': ' in one entry; is a comma missing before the key?");
    return false;
  }

  std::string_view text_;
  std::size_t at_ = 0, line_ = 0;
  bool ends_in_words_ = false;
  TextScan scan_;
};

TextScan scan_text(std::string_view text) { return Scanner(text).scan(); }

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
std::optional<SyntaxMistake> slip_of_lines(std::string_view text, const std::vector<BlockLine>& lines,
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
    return SyntaxMistake{place, fault};
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

std::optional<SyntaxMistake> likely_slip(std::string_view text, std::size_t error_line) {
  const TextScan scan = scan_text(text);
  std::size_t line = 0;
  const auto of_lines = slip_of_lines(text, scan.lines, error_line, line);
  const bool scanned = scan.slip && scan.slip_line <= error_line;
  if (of_lines && (!scanned || line < scan.slip_line)) return of_lines;
  return scanned ? scan.slip : std::nullopt;
}

}  // namespace grapnel
