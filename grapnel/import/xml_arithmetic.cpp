#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "grapnel/import/xml_file.hpp"

namespace grapnel {
namespace {

constexpr int kDeepestExpression = 100;  // parentheses, and signs

// A grammar of four levels: sum, product, power, operand. Empty values go upwards.
class Expression {
 public:
  explicit Expression(std::string_view text) : text_(text) {}

  std::optional<double> value() {
    const auto result = sum(0);
    skip_blanks();
    if (!result || at_ != text_.size() || !std::isfinite(*result)) return std::nullopt;
    return result;
  }

 private:
  using Value = std::optional<double>;

  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }
  bool take(char c) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  Value sum(int depth) {
    Value total = product(depth);
    while (total) {
      const bool is_sum = take('+');
      if (!is_sum && !take('-')) return total;
      const Value next = product(depth);
      total = next ? Value(is_sum ? *total + *next : *total - *next) : std::nullopt;
    }
    return total;
  }
  Value product(int depth) {
    Value total = signed_power(depth);
    while (total) {
      const bool is_product = take('*');
      if (!is_product && !take('/')) return total;
      const Value next = signed_power(depth);
      total = next ? Value(is_product ? *total * *next : *total / *next) : std::nullopt;
    }
    return total;
  }
  Value signed_power(int depth) {
    if (depth > kDeepestExpression) return std::nullopt;
    if (take('+')) return signed_power(depth + 1);
    if (take('-')) {
      const Value value = signed_power(depth + 1);
      return value ? Value(-*value) : std::nullopt;
    }
    const Value base = operand(depth);
    if (!base || !take('^')) return base;
    const Value exponent = signed_power(depth + 1);
    return exponent ? Value(std::pow(*base, *exponent)) : std::nullopt;
  }
  Value operand(int depth) {
    if (take('(')) {
      const Value inside = sum(depth + 1);
      return take(')') ? inside : std::nullopt;
    }
    skip_blanks();
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] >= 'a' && text_[at_] <= 'z') ++at_;
    const std::string_view name = text_.substr(begin, at_ - begin);
    if (name == "pi") return std::numbers::pi;
    if (!name.empty()) return function(name, depth);
    double number = 0;
    const auto [rest, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    if (error != std::errc()) return std::nullopt;
    at_ = static_cast<std::size_t>(rest - text_.data());
    return number;
  }
  Value function(std::string_view name, int depth) {
    using Function = double (*)(double);
    static constexpr std::pair<std::string_view, Function> kFunctions[] = {
        {"sqrt", [](double x) { return std::sqrt(x); }}, {"sin", [](double x) { return std::sin(x); }},
        {"cos", [](double x) { return std::cos(x); }},   {"tan", [](double x) { return std::tan(x); }},
        {"asin", [](double x) { return std::asin(x); }}, {"acos", [](double x) { return std::acos(x); }},
        {"atan", [](double x) { return std::atan(x); }}};
    for (const auto& [known, compute] : kFunctions) {
      if (known != name || !take('(')) continue;
      const Value inside = sum(depth + 1);
      return inside && take(')') ? Value(compute(*inside)) : std::nullopt;
    }
    return std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::optional<double> arithmetic_value(std::string_view text) { return Expression(text).value(); }

}  // namespace grapnel
