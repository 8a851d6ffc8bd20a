#include "grapnel/scenario/text_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>

namespace grapnel {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
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
    scan_.slip = SyntaxSlip{at, std::move(message)};
    scan_.slip_line = line;
  }
  static std::string in_line(std::size_t line) { return fmt::format(" in line {}", line + 1); }

  // What no YAML begins a line with.
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

  // A further line of a text without quotes: deeper than its key and without one of its own.
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

}  // namespace

TextScan scan_text(std::string_view text) { return Scanner(text).scan(); }

bool begins_with_key(std::string_view line) {
  const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  std::size_t end = first;
  while (end < line.size() && is_word(line[end])) ++end;
  return end > first && end < line.size() && line[end] == ':' && (end + 1 == line.size() || is_blank(line[end + 1]));
}

}  // namespace grapnel
