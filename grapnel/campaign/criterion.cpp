#include "grapnel/campaign/criterion.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include "grapnel/campaign/criterion_expression.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

using Expression = Criterion::Expression;
using Kind = Expression::Kind;
using Relation = Expression::Relation;

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// Reads the text from left to right by recursive descent: one function per level of precedence.
class Parser {
 public:
  Parser(std::string_view text, std::span<const std::string> names) : text_(text), names_(names) {}

  Expression parse() {
    if (text_.size() > Criterion::kLongest)
      fail("an expression has at most " + std::to_string(Criterion::kLongest) + " characters, this one has " +
               std::to_string(text_.size()),
           Criterion::kLongest);
    skip_spaces();
    if (at_end()) fail("an expression is missing, such as 'captured' or 'a/b < 0.5'", 0);
    Expression e = any_of();
    if (!at_end()) fail_after_operand();
    return e;
  }

 private:
  [[noreturn]] static void fail(const std::string& message, std::size_t at) { throw CriterionError(message, at); }

  bool at_end() const { return at_ >= text_.size(); }
  std::string_view rest() const { return text_.substr(at_); }
  void skip_spaces() {
    while (!at_end() && is_space(text_[at_])) ++at_;
  }
  bool take(std::string_view symbol) {
    if (!rest().starts_with(symbol)) return false;
    at_ += symbol.size();
    skip_spaces();
    return true;
  }

  // The word at this position, for operators and functions.
  std::string_view word() const {
    std::size_t length = 0;
    while (at_ + length < text_.size() && (is_letter(text_[at_ + length]) || is_digit(text_[at_ + length]))) ++length;
    return text_.substr(at_, length);
  }
  // Description of this position for a message.
  std::string found() const {
    if (at_end()) return "the end";
    std::size_t length = std::max<std::size_t>({1, word().size(), longest_name(rest())});
    while (at_ + length < text_.size() && (static_cast<unsigned char>(text_[at_ + length]) & 0xc0) == 0x80) ++length;
    const auto byte = static_cast<unsigned char>(text_[at_]);
    if (byte < 0x20 || byte == 0x7f) return "a control character";
    constexpr std::size_t kShown = 60;
    std::string shown(text_.substr(at_, std::min(length, kShown)));
    while (length > kShown && !shown.empty() && (static_cast<unsigned char>(shown.back()) & 0x80)) shown.pop_back();
    return "'" + shown + (length > kShown ? "…'" : "'");
  }

  // After an operand: the following text is not an operator.
  [[noreturn]] void fail_after_operand() const {
    const auto instead = [&](std::string_view symbol, const char* right) {
      if (rest().starts_with(symbol))
        fail("there is no operator '" + std::string(symbol) + "'; did you mean '" + right + "'?", at_);
    };
    instead("&&", "and");
    instead("&", "and");
    instead("||", "or");
    instead("|", "or");
    instead("=", "==");
    instead("<>", "!=");
    instead("!", "!=");
    instead("≤", "<=");
    instead("≥", ">=");
    instead("≠", "!=");
    if (text_[at_] == ')') fail("no '(' is open for this ')'", at_);
    if (text_[at_] == '^') fail("there is no operator '^'; write a product", at_);
    if (text_[at_] == ',') fail("',' separates the arguments of min and max only", at_);
    fail("expected an operator (and, or, <, +, …) or the end, found " + found() +
             (is_letter(text_[at_]) ? "; units are written as in '0.2 N s', '5 deg/s'" : ""),
         at_);
  }

  struct Deeper {
    Deeper(int& depth, std::size_t at) : depth_(depth) {
      if (++depth_ > Criterion::kDeepest)
        fail("parentheses, functions and signs are nested at most " + std::to_string(Criterion::kDeepest) + " deep",
             at);
    }
    ~Deeper() { --depth_; }
    int& depth_;
  };

  bool take_word(std::string_view wanted) { return is_ahead(wanted) && take(wanted); }

  Expression node(Kind kind, std::size_t begin) const {
    Expression e;
    e.kind = kind;
    e.begin = begin;
    return e;
  }

  Expression joined(Kind kind, std::string_view operation, Expression (Parser::*part)()) {
    const std::size_t begin = at_;
    Expression first = (this->*part)();
    if (!is_ahead(operation)) return first;
    Expression e = node(kind, begin);
    e.operands.push_back(std::move(first));
    while (take_word(operation)) e.operands.push_back((this->*part)());
    return e;
  }
  // "or/x" and "not-y" are names.
  bool is_ahead(std::string_view operation) const {
    return word() == operation && longest_name(rest()) == operation.size();
  }

  Expression any_of() { return joined(Kind::any_of, "or", &Parser::all_of); }
  Expression all_of() { return joined(Kind::all_of, "and", &Parser::none_of); }

  Expression none_of() {
    const std::size_t begin = at_;
    if (rest().starts_with("!") && !rest().starts_with("!="))
      fail("there is no operator '!'; did you mean 'not'?", at_);
    if (!take_word("not")) return comparison();
    const Deeper deeper(depth_, begin);
    Expression e = node(Kind::none_of, begin);
    e.operands.push_back(none_of());
    return e;
  }

  std::optional<Relation> relation() {
    if (rest().starts_with("<>")) return std::nullopt;
    constexpr std::array<std::pair<std::string_view, Relation>, 6> kRelations{{{"<=", Relation::at_most},
                                                                               {">=", Relation::at_least},
                                                                               {"==", Relation::equal},
                                                                               {"!=", Relation::different},
                                                                               {"<", Relation::less},
                                                                               {">", Relation::greater}}};
    for (const auto& [symbol, meaning] : kRelations) {
      if (take(symbol)) return meaning;
    }
    return std::nullopt;
  }

  Expression comparison() {
    const std::size_t begin = at_;
    Expression left = sum();
    const std::optional<Relation> asked = relation();
    if (!asked) return left;
    Expression e = node(Kind::comparison, begin);
    e.relation = *asked;
    e.operands.push_back(std::move(left));
    e.operands.push_back(sum());
    const std::size_t next = at_;
    if (relation()) fail("comparisons are not chained; write 'a < b and b < c'", next);
    return e;
  }

  Expression chain(Kind kind, char plain, char inverse, Expression (Parser::*part)()) {
    const std::size_t begin = at_;
    Expression first = (this->*part)();
    if (at_end() || (text_[at_] != plain && text_[at_] != inverse)) return first;
    Expression e = node(kind, begin);
    e.operands.push_back(std::move(first));
    e.inverse.push_back(false);
    while (!at_end() && (text_[at_] == plain || text_[at_] == inverse)) {
      const std::size_t at = at_;
      e.inverse.push_back(text_[at_] == inverse);
      ++at_;
      skip_spaces();
      if (kind == Kind::product && !at_end() && text_[at_] == '*')
        fail("there is no operator '**'; write a product", at);
      e.operands.push_back((this->*part)());
    }
    return e;
  }
  Expression sum() { return chain(Kind::sum, '+', '-', &Parser::product); }
  Expression product() { return chain(Kind::product, '*', '/', &Parser::sign); }

  Expression sign() {
    const std::size_t begin = at_;
    if (at_end() || (text_[at_] != '-' && text_[at_] != '+')) return operand();
    const Deeper deeper(depth_, begin);
    const bool negative = text_[at_] == '-';
    ++at_;
    skip_spaces();
    if (!negative) return sign();
    Expression e = node(Kind::negative, begin);
    e.operands.push_back(sign());
    return e;
  }

  Expression operand() {
    const std::size_t begin = at_;
    if (at_end()) fail("expected a number or a name, found the end", at_);
    if (take("(")) {
      const Deeper deeper(depth_, begin);
      Expression e = any_of();
      close(begin);
      return e;
    }
    if (text_[at_] == '`') return quoted();
    // A word before a parenthesis is a function, or a misspelt function.
    std::size_t after = at_ + word().size();
    while (after < text_.size() && is_space(text_[after])) ++after;
    if (is_letter(text_[at_]) && after < text_.size() && text_[after] == '(' && !is_ahead("not")) return function();
    std::optional<LeadingName> name = leading_name(rest(), names_);
    if (const std::size_t length = number_length(); length > 0 && (!name || name->length <= length))
      return number(length);
    if (name) {
      at_ += name->length;
      skip_spaces();
      return named(std::move(name->matches), begin);
    }
    fail_no_name();
  }

  std::size_t number_length() const {
    double ignored = 0;
    if (!is_digit(text_[at_]) && text_[at_] != '.') return 0;
    const auto result = std::from_chars(rest().data(), rest().data() + rest().size(), ignored);
    return static_cast<std::size_t>(result.ptr - rest().data());
  }

  Expression number(std::size_t length) {
    Expression e = node(Kind::number, at_);
    const auto result = std::from_chars(rest().data(), rest().data() + length, e.constant);
    if (result.ec != std::errc()) fail("a number that is too large or too small: " + found(), at_);
    const std::string_view digits = rest().substr(0, length);
    at_ += length;
    skip_spaces();
    if (const std::size_t of_unit = unit_length(); of_unit > 0) {
      const std::string_view unit = rest().substr(0, of_unit);
      e.unit = unit;
      e.constant = in_si({digits, unit}, *unit_named(unit));
      if (!std::isfinite(e.constant)) fail("a number that is too large: " + found(), e.begin);
      at_ += of_unit;
      skip_spaces();
    }
    return e;
  }

  // The longest unit that begins here and ends at the end of a word. After a number only units, and the operators `and`
  // and `or`, begin with a letter.
  std::size_t unit_length() const {
    constexpr std::size_t kLongestUnit = 40;
    const auto is_of_word = [](char c) {
      return is_letter(c) || is_digit(c) || (static_cast<unsigned char>(c) & 0x80);
    };
    if (at_end() || !is_of_word(text_[at_])) return 0;
    for (std::size_t length = std::min(rest().size(), kLongestUnit); length > 0; --length) {
      const char last = rest()[length - 1];
      if (is_space(last) || (length < rest().size() && is_of_word(last) && is_of_word(rest()[length]))) continue;
      if (unit_named(rest().substr(0, length))) return length;
    }
    return 0;
  }

  static Expression named(std::vector<NameMatch> matches, std::size_t begin) {
    Expression e;
    e.kind = Kind::name;
    e.begin = begin;
    for (NameMatch& match : matches) {
      e.indices.push_back(match.index);
      if (!match.stars.empty()) e.stars.push_back(std::move(match.stars));
    }
    return e;
  }

  Expression quoted() {
    const std::size_t begin = at_;
    const std::size_t end = text_.find('`', begin + 1);
    if (end == std::string_view::npos) fail("the name that begins with ` does not end", begin);
    const std::string_view name = text_.substr(begin + 1, end - begin - 1);
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end())
      fail("unknown number '" + std::string(name.substr(0, 100)) + "'" + near_name(name, names_), begin + 1);
    at_ = end + 1;
    skip_spaces();
    return named({{{}, static_cast<std::size_t>(found - names_.begin())}}, begin);
  }

  Expression function() {
    constexpr std::array<std::pair<std::string_view, Kind>, 4> kFunctions{
        {{"abs", Kind::abs}, {"sqrt", Kind::sqrt}, {"min", Kind::min}, {"max", Kind::max}}};
    const std::size_t begin = at_;
    const Deeper deeper(depth_, begin);
    const std::string_view called = word();
    const auto which =
        std::find_if(kFunctions.begin(), kFunctions.end(), [&](const auto& f) { return f.first == called; });
    if (which == kFunctions.end())
      fail("there is no function '" + std::string(called.substr(0, 60)) + "'; functions are abs, sqrt, min, max",
           begin);
    take(called);
    const std::size_t parenthesis = at_;
    take("(");
    Expression e = node(which->second, begin);
    const bool several = e.kind == Kind::min || e.kind == Kind::max;
    do {
      e.operands.push_back(any_of());
      if (!several && rest().starts_with(",")) fail(std::string(called) + " takes one argument", at_);
    } while (take(","));
    close(parenthesis);
    return e;
  }

  void close(std::size_t opened) {
    if (take(")")) return;
    if (at_end()) fail("this '(' is not closed", opened);
    fail_after_operand();
  }

  [[noreturn]] void fail_no_name() const {
    const std::size_t length = longest_name(rest());
    const std::string_view name = rest().substr(0, length);
    if (length == 0 ||
        !(is_letter(name[0]) || is_digit(name[0]) || static_cast<unsigned char>(name[0]) >= 0x80 || name[0] == '*'))
      fail("expected a number or a name, found " + found(), at_);
    if (name == "and" || name == "or") fail("expected a number or a name before '" + std::string(name) + "'", at_);
    if (name == "status" || name == "success" || name == "reason" || name == "ok")
      fail("'" + std::string(name) + "' is not a number of a case; cases that are not ok are never a success", at_);
    if (name.find('*') != std::string_view::npos) fail("no name matches " + found(), at_);
    std::string near = near_name(name, names_);
    // "captred-1": the text before the operator may be a misspelt name.
    if (near.empty()) near = near_name(name.substr(0, name.find_first_of("-/")), names_);
    fail("unknown number " + found() + near, at_);
  }

  std::string_view text_;
  std::span<const std::string> names_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

/// Finds the names with stars that are expanded together: all names of a comparison, of a single condition, of an
/// argument of min or max.
class Passes {
 public:
  static void of_condition(Expression& e) {
    if (e.kind == Kind::all_of || e.kind == Kind::any_of || e.kind == Kind::none_of) {
      for (Expression& part : e.operands) of_condition(part);
      return;
    }
    if (e.kind != Kind::comparison) {
      Expression condition;
      condition.kind = Kind::condition;
      condition.begin = e.begin;
      condition.operands.push_back(std::move(e));
      e = std::move(condition);
    }
    Passes passes;
    for (Expression& side : e.operands) passes.of_number(side);
    e.passes = {passes.count()};
  }

 private:
  void of_number(Expression& e) {
    if (e.kind == Kind::min || e.kind == Kind::max) {
      for (Expression& argument : e.operands) {
        Passes own;
        own.of_number(argument);
        e.passes.push_back(own.count());
      }
    } else if (e.kind >= Kind::comparison) {
      of_condition(e);
    } else if (e.kind == Kind::name && !e.stars.empty()) {
      if (first_ && first_->stars != e.stars)
        throw CriterionError("the stars of these names do not match the same parts", e.begin);
      if (!first_) first_ = &e;
    } else {
      for (Expression& operand : e.operands) of_number(operand);
    }
  }
  std::size_t count() const { return first_ ? first_->indices.size() : 1; }

  const Expression* first_ = nullptr;
};

}  // namespace

Criterion Criterion::parse(const std::string& text, std::span<const std::string> names, const std::string& name,
                           std::span<const std::string> units) {
  Expression root = Parser(text, names).parse();
  check_units(root, names, units);
  Passes::of_condition(root);
  Criterion criterion;
  criterion.text_ = text;
  criterion.name_ = name.empty() ? text : name;
  collect_reads(root, criterion.reads_);
  std::sort(criterion.reads_.begin(), criterion.reads_.end());
  criterion.reads_.erase(std::unique(criterion.reads_.begin(), criterion.reads_.end()), criterion.reads_.end());
  collect_limits(root, criterion.limits_);
  criterion.root_ = std::make_shared<const Expression>(std::move(root));
  return criterion;
}

Verdict Criterion::judge(std::span<const double> numbers) const {
  const double value = value_of(*root_, numbers, 0);
  return std::isnan(value) ? Verdict::not_checked : value != 0 ? Verdict::yes : Verdict::no;
}

}  // namespace grapnel
