#include "grapnel/scenario/plain_scalar.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

#include "grapnel/scenario/number_advice.hpp"
#include "grapnel/scenario/spelling.hpp"

namespace grapnel {
namespace {

bool digit(char c) { return c >= '0' && c <= '9'; }
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

// The value of decimal text; empty where a double cannot hold it.
std::optional<double> decimal_value(std::string_view text) {
  if (text[0] == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

// Whether decimal text that a double cannot hold is too small rather than too large.
bool is_tiny(std::string_view text) {
  text = without_sign(text);
  const std::size_t e = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, e);
  // The power of ten of the first digit that counts. Files have some millions of characters at most.
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
           (is_tiny(node.text) ? " is smaller than a double resolves" : " is beyond what a double holds");
  }
  return ", not " + described(node) + number_advice(node.text);
}

}  // namespace grapnel
