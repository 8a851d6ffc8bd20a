#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "grapnel/import/xml_file.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// 0x80 to 0x9f of Windows-1252; 0 where it has no character.
constexpr std::array<std::uint16_t, 32> kWindows = {0x20ac, 0,      0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021,
                                                    0x02c6, 0x2030, 0x0160, 0x2039, 0x0152, 0,      0x017d, 0,
                                                    0,      0x2018, 0x2019, 0x201c, 0x201d, 0x2022, 0x2013, 0x2014,
                                                    0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0,      0x017e, 0x0178};

enum class Encoding { utf8, utf16_little, utf16_big, latin_1, latin_9, windows, ascii, unknown };

void append_utf8(std::string& text, std::uint32_t c) {
  if (c < 0x80) {
    text += static_cast<char>(c);
    return;
  }
  const int further = c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
  text += static_cast<char>((further == 1 ? 0xc0u : further == 2 ? 0xe0u : 0xf0u) | c >> 6 * further);
  for (int k = further - 1; k >= 0; --k) text += static_cast<char>(0x80u | (c >> 6 * k & 0x3fu));
}

// The character of an encoding with one byte for each; U+FFFD where there is none.
std::uint32_t character_of(unsigned char byte, Encoding encoding) {
  if (byte < 0x80) return byte;
  if (encoding == Encoding::windows && byte < 0xa0) {
    const std::uint16_t c = kWindows[byte - 0x80u];
    return c == 0 ? 0xfffd : c;
  }
  if (encoding == Encoding::latin_9) {
    constexpr std::array<std::pair<unsigned char, std::uint16_t>, 8> kOther = {{{0xa4, 0x20ac},
                                                                                {0xa6, 0x0160},
                                                                                {0xa8, 0x0161},
                                                                                {0xb4, 0x017d},
                                                                                {0xb8, 0x017e},
                                                                                {0xbc, 0x0152},
                                                                                {0xbd, 0x0153},
                                                                                {0xbe, 0x0178}}};
    for (const auto& [at, c] : kOther) {
      if (at == byte) return c;
    }
  }
  return encoding == Encoding::ascii ? 0xfffd : byte;
}

std::string from_bytes(std::string_view bytes, Encoding encoding) {
  std::string text;
  text.reserve(bytes.size() + bytes.size() / 8);
  for (const char c : bytes) append_utf8(text, character_of(static_cast<unsigned char>(c), encoding));
  return text;
}

std::string from_utf16(std::string_view bytes, bool is_big) {
  std::string text;
  text.reserve(bytes.size());
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(bytes[i]), second = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<std::uint32_t>(is_big ? first << 8 | second : second << 8 | first);
  };
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    const bool is_high = c >= 0xd800 && c < 0xdc00;
    if (is_high && i + 3 < bytes.size() && unit(i + 2) >= 0xdc00 && unit(i + 2) < 0xe000)
      c = 0x10000 + ((c - 0xd800) << 10) + (unit(i + 2) - 0xdc00), i += 2;
    else if (c >= 0xd800 && c < 0xe000)
      c = 0xfffd;
    append_utf8(text, c);
  }
  return text;
}

// Where the declaration names an encoding; empty if it does not.
struct Declared {
  std::size_t begin = 0, size = 0;
};
std::optional<Declared> declared_in(std::string_view text) {
  if (!text.starts_with("<?xml")) return std::nullopt;
  const std::string_view declaration = text.substr(0, text.find("?>"));
  std::size_t at = declaration.find("encoding");
  if (at == std::string_view::npos) return std::nullopt;
  at = declaration.find_first_of("\"'", at);
  if (at == std::string_view::npos) return std::nullopt;
  const std::size_t end = declaration.find(declaration[at], at + 1);
  if (end == std::string_view::npos) return std::nullopt;
  return Declared{at + 1, end - at - 1};
}

Encoding encoding_named(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z')
      plain += static_cast<char>(c - 'A' + 'a');
    else if (c != '-' && c != '_' && c != ' ')
      plain += c;
  }
  for (const auto& [known, encoding] : std::initializer_list<std::pair<std::string_view, Encoding>>{
           {"utf8", Encoding::utf8},
           {"utf16", Encoding::utf8},  // declared by programs that then write UTF-8
           {"iso88591", Encoding::latin_1},
           {"latin1", Encoding::latin_1},
           {"l1", Encoding::latin_1},
           {"iso885915", Encoding::latin_9},
           {"latin9", Encoding::latin_9},
           {"windows1252", Encoding::windows},
           {"cp1252", Encoding::windows},
           {"usascii", Encoding::ascii},
           {"ascii", Encoding::ascii}}) {
    if (known == plain) return encoding;
  }
  return Encoding::unknown;
}

// UTF-16 by its byte order mark, or by the first character, which is '<' or a blank.
std::optional<Encoding> wide_encoding(std::string_view bytes) {
  if (bytes.starts_with("\xff\xfe")) return Encoding::utf16_little;
  if (bytes.starts_with("\xfe\xff")) return Encoding::utf16_big;
  if (bytes.size() < 2) return std::nullopt;
  if (bytes[0] == '<' && bytes[1] == '\0') return Encoding::utf16_little;
  if (bytes[0] == '\0' && bytes[1] == '<') return Encoding::utf16_big;
  return std::nullopt;
}

// The first byte that is no UTF-8.
std::optional<std::size_t> first_foreign(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    if (length == 0) return i;
    i += length;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> xml_in_utf8(const std::string& path, std::string bytes, std::string& note,
                                       FaultList& faults) {
  const auto wide = wide_encoding(bytes);
  if (wide) {
    std::string_view content = bytes;
    if (content[0] != '<' && content[1] != '<') content.remove_prefix(2);
    bytes = from_utf16(content, *wide == Encoding::utf16_big);
  } else if (bytes.starts_with("\xef\xbb\xbf")) {
    bytes.erase(0, 3);
  }
  const auto declared = declared_in(bytes);
  const std::string name = declared ? bytes.substr(declared->begin, declared->size) : std::string();
  Encoding encoding = wide || !declared ? Encoding::utf8 : encoding_named(name);
  const auto foreign = first_foreign(bytes);
  if (encoding == Encoding::unknown) {
    // ASCII alone is the same in all of them.
    const bool is_plain =
        std::all_of(bytes.begin(), bytes.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
    if (!is_plain) {
      const Mark mark{std::make_shared<const std::string>(path), 1, static_cast<int>(declared->begin) + 1};
      faults.add(mark, fmt::format("the encoding {} is not read; UTF-8, UTF-16, ISO-8859-1, ISO-8859-15 and "
                                   "Windows-1252 are: save the file as UTF-8",
                                   in_quotes(name)));
      return std::nullopt;
    }
    encoding = Encoding::utf8;
  }
  if (encoding == Encoding::utf8 && foreign) {
    note = fmt::format("the file is not the UTF-8 that it {} (byte 0x{:02x} at {}): it is read as Windows-1252",
                       declared ? "declares" : "must be without a declared encoding",
                       static_cast<unsigned char>(bytes[*foreign]), *foreign + 1);
    encoding = Encoding::windows;
  }
  if (declared && (wide || encoding != Encoding::utf8)) bytes.replace(declared->begin, declared->size, "UTF-8");
  return encoding == Encoding::utf8 ? bytes : from_bytes(bytes, encoding);
}

}  // namespace grapnel
