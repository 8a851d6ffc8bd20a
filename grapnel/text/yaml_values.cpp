#include "grapnel/text/yaml_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

bool digit(char c) { return c >= '0' && c <= '9'; }

// The number at the beginning of the text, which is removed from it.
std::optional<double> take_number(std::string_view& text) {
  std::string_view rest = text;
  if (rest.starts_with('+')) rest.remove_prefix(1);
  const std::string_view digits = rest.starts_with('-') ? rest.substr(1) : rest;
  if (digits.empty() || !(digit(digits[0]) || digits[0] == '.')) return {};  // no "inf", no "nan"
  double value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc()) return {};
  text = rest.substr(static_cast<std::size_t>(end - rest.data()));
  return value;
}

std::optional<double> whole_number(std::string_view text) {
  const auto value = take_number(text);
  return text.empty() ? value : std::nullopt;
}

// A text with all occurrences replaced.
std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(' '), text.size());
  text.remove_prefix(first);
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

// For places with numbers without units, such as tables.
std::string unit_advice(std::string_view text) {
  const auto value = number_and_unit(text);
  const auto unit = value ? unit_named(value->unit) : std::nullopt;
  const double number = unit ? in_si(*value, *unit) : NAN;
  return std::isfinite(number) ? fmt::format("; numbers have no units here, write {}", number) : "";
}

// "10,5", "1_000", "1'000", "1 000", "1,000".
std::string separator_advice(std::string_view text) {
  const std::size_t commas = static_cast<std::size_t>(std::count(text.begin(), text.end(), ','));
  const std::string with_point = replaced(std::string(text), ",", ".");
  if (commas == 1 && text.find('.') == std::string_view::npos && whole_number(with_point)) {
    const std::size_t digits_behind = text.size() - text.find(',') - 1;
    const bool thousands = digits_behind == 3 && std::all_of(text.end() - 3, text.end(), digit) && text[0] != '0';
    if (!thousands) return "; use a decimal point, write " + shortened(with_point);
    return fmt::format("; write {} or {}", shortened(with_point), shortened(replaced(std::string(text), ",", "")));
  }
  for (const std::string_view separator : {"_", "'", " ", ",", "\u00a0", "\u202f"}) {
    const std::string joined = replaced(std::string(text), separator, "");
    // Only in groups of three: "1 2" may be two numbers.
    std::size_t last = text.rfind(separator);
    if (last == std::string_view::npos || last == 0 || !whole_number(joined)) continue;
    last += separator.size();
    std::size_t digits = 0;
    while (last + digits < text.size() && digit(text[last + digits])) ++digits;
    if (digits == 3) return "; digits are not grouped, write " + shortened(joined);
  }
  return {};
}

// The value of products and quotients of numbers and pi.
std::string expression_advice(std::string_view text) {
  double value = text.starts_with('-') ? -1 : 1;
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  char sign = '*';
  for (int factors = 0;; ++factors) {
    text = trimmed(text);
    std::optional<double> factor;
    for (const std::string_view pi : {"pi", "PI", "Pi", "\u03c0", "M_PI", "math.pi", "np.pi"}) {
      if (factor || !text.starts_with(pi)) continue;
      factor = std::numbers::pi;
      text.remove_prefix(pi.size());
    }
    if (!factor && !text.empty() && digit(text[0])) factor = take_number(text);
    if (!factor) return {};
    value = sign == '*' ? value * *factor : value / *factor;
    text = trimmed(text);
    if (text.empty()) return std::isfinite(value) ? fmt::format("; values are not calculated, write {}", value) : "";
    if (text[0] != '*' && text[0] != '/') return {};
    sign = text[0];
    text.remove_prefix(1);
    if (factors > 8) return {};
  }
}

// The letters O, l and I for digits, D for the exponent's e, U+2212 for the minus.
std::string letter_advice(std::string_view text) {
  for (const auto& [letter, meant] : {std::pair{"D", "e"},
                                      {"d", "e"},
                                      {"O", "0"},
                                      {"o", "0"},
                                      {"l", "1"},
                                      {"I", "1"},
                                      {"\u2212", "-"},
                                      {"\u2013", "-"}}) {
    if (text.find(letter) == std::string_view::npos) continue;
    const std::string read = replaced(std::string(text), letter, meant);
    if (whole_number(read)) return fmt::format("; did you mean {}?", shortened(read));
  }
  return {};
}

bool all_digits(std::string_view text) { return !text.empty() && std::all_of(text.begin(), text.end(), digit); }

std::string_view without_sign(std::string_view text) {
  return !text.empty() && (text[0] == '+' || text[0] == '-') ? text.substr(1) : text;
}

// Two digits or more before any point, the first a zero: 010, 007.5.
bool looks_octal(std::string_view text) {
  const std::string_view body = without_sign(text);
  return body.size() > 1 && body[0] == '0' && digit(body[1]);
}

// Digits, a point, an exponent; at least one digit in the mantissa.
bool decimal_grammar(std::string_view text) {
  const std::string_view body = without_sign(text);
  const std::size_t e = body.find_first_of("eE");
  std::string mantissa(body.substr(0, e));
  if (e != std::string_view::npos && !all_digits(without_sign(body.substr(e + 1)))) return false;
  if (const std::size_t point = mantissa.find('.'); point != std::string::npos) mantissa.erase(point, 1);
  return all_digits(mantissa);
}

std::optional<double> infinity_or_nan(std::string_view text) {
  const std::string_view body = without_sign(text);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (body == ".inf" || body == ".Inf" || body == ".INF") return text[0] == '-' ? -kInfinity : kInfinity;
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::numeric_limits<double>::quiet_NaN();
  return {};
}

// The value of decimal text; empty outside the range of a double.
std::optional<double> decimal_value(std::string_view text) {
  if (text[0] == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

// Whether decimal text outside the range of a double is too small rather than too large.
bool is_tiny(std::string_view text) {
  text = without_sign(text);
  const std::size_t e = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, e);
  // The power of ten of the first significant digit. Files have at most some millions of characters.
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  const std::size_t first = std::min(mantissa.find_first_of("123456789"), mantissa.size());
  const auto power = static_cast<std::int64_t>(point) - static_cast<std::int64_t>(first);
  if (e == text.size()) return power < 0;
  std::string_view digits = text.substr(e + 1);
  if (digits[0] == '+') digits.remove_prefix(1);
  std::int64_t exponent = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
  if (error != std::errc()) return digits[0] == '-';
  return exponent < -power;
}

// "write the decimal number n" for 0x1f, 0o17, 0b101; empty for anything else.
std::string based_number_advice(std::string_view text) {
  const std::string_view body = without_sign(text);
  if (body.size() < 3 || body[0] != '0') return {};
  const int base = body[1] == 'x' || body[1] == 'X' ? 16 : body[1] == 'o' ? 8 : body[1] == 'b' ? 2 : 0;
  if (base == 0) return {};
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(body.data() + 2, body.data() + body.size(), value, base);
  if (error != std::errc() || end != body.data() + body.size()) return {};
  return std::string("write the decimal number ") + (text[0] == '-' ? "-" : "") + std::to_string(value);
}

std::string without_leading_zeros(std::string_view text) {
  std::string result(text[0] == '-' ? "-" : "");
  text = without_sign(text);
  while (text.size() > 1 && text[0] == '0' && digit(text[1])) text.remove_prefix(1);
  return result + std::string(text);
}

}  // namespace

std::string number_advice(std::string_view text) {
  if (text.size() > 60) return {};
  if (const std::size_t comment = text.find(" //");
      comment != std::string_view::npos && whole_number(trimmed(text.substr(0, comment)))) {
    return "; comments begin with '#'";
  }
  const std::string spaced = replaced(std::string(text), "\u00a0", " ");
  if (spaced != text && whole_number(trimmed(spaced))) return "; remove the no-break space";
  for (const auto advice : {separator_advice, unit_advice, expression_advice, letter_advice}) {
    if (std::string found = advice(text); !found.empty()) return found;
  }
  return {};
}

std::string list_advice(std::string_view text) {
  if (text.size() > 200) return {};
  if (text.starts_with('(') && text.ends_with(')')) text = text.substr(1, text.size() - 2);
  std::string list;
  int count = 0;
  for (std::string_view rest = trimmed(text); !rest.empty(); ++count) {
    const std::size_t end = std::min(rest.find_first_of(", "), rest.size());
    if (!whole_number(rest.substr(0, end))) return {};
    list += (count == 0 ? "" : ", ") + std::string(rest.substr(0, end));
    rest = trimmed(rest.substr(end));
    if (rest.starts_with(',')) rest = trimmed(rest.substr(1));
  }
  return count < 2 ? "" : "; write a list in brackets: [" + shortened(list) + "]";
}

std::optional<double> number_of(const Node& node) {
  if (!node.is_scalar() || !node.plain || node.text.empty()) return {};
  if (const auto special = infinity_or_nan(node.text)) return special;
  if (looks_octal(node.text) || !decimal_grammar(node.text)) return {};
  return decimal_value(node.text);
}

std::optional<bool> boolean_of(const Node& node) {
  if (!node.is_scalar() || !node.plain) return {};
  if (node.text == "true" || node.text == "True" || node.text == "TRUE") return true;
  if (node.text == "false" || node.text == "False" || node.text == "FALSE") return false;
  return {};
}

bool is_text(const Node& node) {
  return node.is_scalar() &&
         (!node.plain || (!boolean_of(node) && !decimal_grammar(node.text) && !infinity_or_nan(node.text)));
}

bool is_decimal_comma(const Node& whole, const Node& fraction, const Mark& place) {
  return whole.is_scalar() && whole.plain && all_digits(without_sign(whole.text)) && fraction.is_scalar() &&
         fraction.plain && all_digits(fraction.text) && place.line > 0 && place.line == whole.mark.line &&
         place.column == whole.mark.column + static_cast<int>(whole.text.size()) + 1;
}

std::string described(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return "empty";
    case Node::Kind::sequence:
      return "a list";
    case Node::Kind::mapping:
      return "a mapping";
    case Node::Kind::scalar:
      break;
  }
  if (number_of(node)) return "the number " + shortened(node.text);
  if (boolean_of(node)) return node.text;
  return "the text " + in_quotes(node.text);
}

std::string why_no_number(const Node& node) {
  if (!node.is_scalar()) return ", not " + described(node);
  Node as_plain = node;
  as_plain.plain = true;
  if (!node.plain && number_of(as_plain)) return "; remove the quotes around " + in_quotes(node.text);
  if (!node.plain) return ", not " + described(node);
  if (looks_octal(node.text) && decimal_grammar(node.text)) {
    return "; " + in_quotes(node.text) + " looks octal, write " + shortened(without_leading_zeros(node.text));
  }
  if (const std::string advice = based_number_advice(node.text); !advice.empty()) {
    return "; " + in_quotes(node.text) + " is not accepted, " + advice;
  }
  if (!node.text.empty() && decimal_grammar(node.text)) {
    return "; " + in_quotes(node.text) +
           (is_tiny(node.text) ? " is below the range of a double" : " is above the range of a double");
  }
  return ", not " + described(node) + number_advice(node.text);
}

Node number_node(double value, const Mark& mark) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.mark = mark;
  node.text = fmt::format("{}", value);  // the shortest that reads back to the same double
  return node;
}

Node list_node(std::span<const double> values, const Mark& mark) {
  Node node;
  node.kind = Node::Kind::sequence;
  node.mark = mark;
  for (const double value : values) node.items.push_back(number_node(value, mark));
  return node;
}

Node mapping_node(const Mark& mark) {
  Node node;
  node.kind = Node::Kind::mapping;
  node.mark = mark;
  return node;
}
Node sequence_node(const Mark& mark) {
  Node node;
  node.kind = Node::Kind::sequence;
  node.mark = mark;
  return node;
}
Node text_node(const std::string& text, const Mark& mark) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.mark = mark;
  node.text = text;
  node.plain = is_text(node);
  return node;
}
void put(Node& mapping, std::string_view key, Node value) {
  if (Node* present = mapping.find(key))
    *present = std::move(value);
  else
    mapping.entries.push_back({std::string(key), value.mark, std::move(value)});
}

std::optional<std::vector<double>> numbers_in(const Node& value) {
  std::vector<double> numbers;
  const auto take = [&](const Node& node) {
    const auto number = number_of(node);
    if (!number || !std::isfinite(*number)) return false;
    numbers.push_back(*number);
    return true;
  };
  if (value.is_scalar()) {
    if (!take(value)) return {};
  } else {
    for (const Node& item : value.items) {
      if (!take(item)) return {};
    }
    for (const NodeEntry& entry : value.entries) {
      if (!take(entry.value)) return {};
    }
  }
  if (numbers.empty()) return {};
  return numbers;
}

Node with_numbers(Node form, std::span<const double> numbers, const Mark& mark) {
  form.mark = mark;
  if (form.is_scalar()) return number_node(numbers[0], mark);
  std::size_t at = 0;
  for (Node& item : form.items) item = number_node(numbers[at++], mark);
  for (NodeEntry& entry : form.entries) entry.value = number_node(numbers[at++], mark), entry.mark = mark;
  return form;
}

std::string number_name(const Node& form, std::size_t index) {
  if (form.is_scalar()) return {};
  if (form.is_mapping()) return form.entries[index].key;
  if (form.items.size() == 3) return std::string(1, "xyz"[index]);
  return fmt::format("{}", index);
}

}  // namespace grapnel
