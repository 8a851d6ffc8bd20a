#include "grapnel/report/gnuplot_text.hpp"

#include <algorithm>
#include <stdexcept>

namespace grapnel {
namespace {

bool is_control(unsigned char c) { return c < 0x20 || c == 0x7f; }

// Bytes of the UTF-8 character that begins at `at`; 0 if none does.
std::size_t character_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(at);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xc2 && first < 0xe0 ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  }
  if (length > 2) {  // overlong forms, surrogates, beyond the last character
    const unsigned char second = byte(at + 1);
    if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) || (first == 0xf0 && second < 0x90) ||
        (first == 0xf4 && second > 0x8f))
      return 0;
  }
  return length;
}

}  // namespace

std::string plain_line(std::string_view text) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_length(text, at);
    if (length == 0) {
      line += '?';
    } else if (length == 1) {
      line += is_control(static_cast<unsigned char>(text[at])) ? ' ' : text[at];
    } else {
      line += text.substr(at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return line;
}

std::string gnuplot_quoted(std::string_view text) {
  const std::string line = plain_line(text);
  // gnuplot takes three apostrophes for an empty constant and the beginning of another. Those at the beginning stand in
  // a constant of their own, with nothing else.
  const std::size_t first = std::min(line.find_first_not_of('\''), line.size());
  std::string quoted = first > 0 ? '"' + line.substr(0, first) + "\".'" : "'";
  for (const char c : line.substr(first)) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

std::string gnuplot_tic_label(std::string_view text) {
  std::string doubled;
  for (const char c : text) doubled += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_quoted(doubled);
}

std::string gnuplot_file(std::string_view name) {
  if (std::any_of(name.begin(), name.end(), [](char c) { return is_control(static_cast<unsigned char>(c)); }))
    throw std::invalid_argument("a figure's file name must not have control characters: '" + plain_line(name) + "'");
  const bool plain = !name.empty() && ((name[0] >= 'a' && name[0] <= 'z') || (name[0] >= 'A' && name[0] <= 'Z') ||
                                       (name[0] >= '0' && name[0] <= '9'));
  std::string quoted = plain ? "'" : "'./";
  for (const char c : name) quoted += c == '\'' ? std::string("''") : std::string(1, c);  // bytes as they are
  return quoted + "'";
}

}  // namespace grapnel
