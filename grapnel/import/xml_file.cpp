#include "grapnel/import/xml_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Continuation bytes of UTF-8 are no characters.
bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }

}  // namespace

XmlFile::XmlFile(const std::string& path, std::string text, FaultList& faults, Numbers numbers)
    : source_(std::make_shared<const std::string>(path)), form_(numbers) {
  line_begins_.push_back(0);
  auto utf8 = xml_in_utf8(path, std::move(text), encoding_note_, faults);
  if (!utf8) return;
  text_ = std::move(*utf8);
  std::size_t characters = 0;
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (i % kBlock == 0) characters_.push_back(characters);
    characters += begins_character(text_[i]) ? 1 : 0;
    if (text_[i] == '\n') line_begins_.push_back(i + 1);
  }
  // Parsed in place without conversion, so that names point to their position in the text. Lines are counted
  // before, since parsing may rewrite values.
  const pugi::xml_parse_result result =
      document_.load_buffer_inplace(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (result) return;
  faults.add(mark_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))),
             fmt::format("this is no well-formed XML: {}", result.description()));
  document_.reset();
}

Mark XmlFile::mark_at(std::size_t offset) const {
  const auto after = std::upper_bound(line_begins_.begin(), line_begins_.end(), offset);
  const auto line = static_cast<std::size_t>(after - line_begins_.begin());
  const std::size_t column = characters_before(offset) - characters_before(line_begins_[line - 1]) + 1;
  return {source_, static_cast<int>(line), static_cast<int>(column)};
}

std::size_t XmlFile::characters_before(std::size_t offset) const {
  if (text_.empty()) return 0;
  offset = std::min(offset, text_.size());
  const std::size_t block = std::min(offset / kBlock, characters_.size() - 1);
  const auto begin = text_.begin() + static_cast<std::ptrdiff_t>(block * kBlock);
  const auto end = text_.begin() + static_cast<std::ptrdiff_t>(offset);
  return characters_[block] + static_cast<std::size_t>(std::count_if(begin, end, begins_character));
}

Mark XmlFile::mark(const pugi::xml_node& node) const {
  const std::ptrdiff_t offset = node.offset_debug();
  return offset < 0 ? Mark{source_, 1, 1} : mark_at(static_cast<std::size_t>(offset));
}

Mark XmlFile::mark(const pugi::xml_node& node, std::string_view attribute) const {
  const pugi::xml_attribute found = node.attribute(std::string(attribute).c_str());
  return found ? mark_at(static_cast<std::size_t>(found.name() - text_.data())) : mark(node);
}

std::optional<double> XmlFile::value_of(std::string_view word, const pugi::xml_node& node,
                                        const char* attribute) const {
  std::string_view plain = word;
  if (plain.starts_with('+')) plain.remove_prefix(1);
  double number = 0;
  const auto [rest, error] = std::from_chars(plain.data(), plain.data() + plain.size(), number);
  if (error == std::errc() && rest == plain.data() + plain.size())
    return std::isfinite(number) ? std::optional(number) : std::nullopt;
  if (form_ == Numbers::plain) return std::nullopt;
  const auto value = arithmetic_value(word);
  if (value && expressions_++ == 0) first_expression_ = mark(node, attribute);
  return value;
}

std::optional<std::vector<double>> XmlFile::numbers(const pugi::xml_node& node, const char* attribute,
                                                    std::size_t count, FaultList& faults) const {
  const pugi::xml_attribute found = node.attribute(attribute);
  if (!found) return std::nullopt;
  const std::string_view value = found.value();
  std::vector<double> numbers;
  std::size_t at = 0;
  while (true) {
    at = value.find_first_not_of(" \t\r\n", at);
    if (at == std::string_view::npos) break;
    const std::size_t end = std::min(value.find_first_of(" \t\r\n", at), value.size());
    // A single number may have blanks within.
    const bool is_whole = count == 1 && form_ == Numbers::arithmetic;
    const std::string_view word =
        is_whole ? value.substr(at, value.find_last_not_of(" \t\r\n") + 1 - at) : value.substr(at, end - at);
    const auto number = value_of(word, node, attribute);
    if (!number) {
      faults.add(mark(node, attribute),
                 fmt::format("{} of <{}>: {} is no finite number{}", attribute, node.name(), in_quotes(word),
                             word.find("${") != std::string_view::npos
                                 ? ", but an expression of xacro, which has to be expanded"
                                 : ""));
      return std::nullopt;
    }
    numbers.push_back(*number);
    at = is_whole ? value.size() : end;
  }
  if (count != 0 && numbers.size() != count) {
    faults.add(mark(node, attribute),
               fmt::format("{} of <{}> has {} numbers, expected {}", attribute, node.name(), numbers.size(), count));
    return std::nullopt;
  }
  return numbers;
}

std::optional<double> XmlFile::number(const pugi::xml_node& node, const char* attribute, FaultList& faults) const {
  const auto list = numbers(node, attribute, 1, faults);
  if (!list) return std::nullopt;
  return list->front();
}

std::optional<Vector3d> XmlFile::vector(const pugi::xml_node& node, const char* attribute, FaultList& faults) const {
  const auto list = numbers(node, attribute, 3, faults);
  if (!list) return std::nullopt;
  return Vector3d{(*list)[0], (*list)[1], (*list)[2]};
}

std::string XmlFile::required_text(const pugi::xml_node& node, const char* attribute, FaultList& faults) const {
  const std::string text = node.attribute(attribute).value();
  if (text.empty()) {
    faults.add(mark(node, attribute), fmt::format("<{}> has no {}", node.name(), in_quotes(attribute)));
  }
  return text;
}

}  // namespace grapnel
