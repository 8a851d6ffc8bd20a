#include "grapnel/campaign/criterion_expression.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kLongestCompared = 120;  // bytes; the comparison of two words takes their product

bool is_name_character(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalnum(byte) || byte >= 0x80 || c == '_' || c == '.' || c == '-' || c == '/';
}

std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('/', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// Edit distance (Levenshtein) without regard to case; at most `most` + 1.
std::size_t edits(std::string_view a, std::string_view b, std::size_t most) {
  if (std::max(a.size(), b.size()) - std::min(a.size(), b.size()) > most) return most + 1;
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t kept = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, kept});
    }
  }
  return std::min(row.back(), most + 1);
}

}  // namespace

std::vector<NameMatch> matching_names(std::string_view pattern, std::span<const std::string> names) {
  std::vector<NameMatch> matches;
  if (pattern.find('*') == std::string_view::npos) {
    const auto found = std::find(names.begin(), names.end(), pattern);
    if (found != names.end()) matches.push_back({{}, static_cast<std::size_t>(found - names.begin())});
    return matches;
  }
  const std::vector<std::string_view> wanted = parts_of(pattern);
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::vector<std::string_view> parts = parts_of(names[n]);
    if (parts.size() != wanted.size()) continue;
    NameMatch match{{}, n};
    bool same = true;
    for (std::size_t i = 0; same && i < parts.size(); ++i) {
      if (wanted[i] == "*")
        match.stars.emplace_back(parts[i]);
      else
        same = wanted[i] == parts[i];
    }
    if (same) matches.push_back(std::move(match));
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const NameMatch& a, const NameMatch& b) { return a.stars < b.stars; });
  const auto last = std::unique(matches.begin(), matches.end(),
                                [](const NameMatch& a, const NameMatch& b) { return a.stars == b.stars; });
  matches.erase(last, matches.end());
  return matches;
}

std::size_t longest_name(std::string_view text) {
  std::size_t length = 0;
  for (; length < text.size(); ++length) {
    if (is_name_character(text[length])) continue;
    // A star is a wildcard only as a whole part; otherwise it multiplies.
    const bool begins = length == 0 || text[length - 1] == '/';
    const bool ends = length + 1 == text.size() || text[length + 1] == '/' || !is_name_character(text[length + 1]);
    if (text[length] != '*' || !begins || !ends) break;
  }
  return length;
}

std::optional<LeadingName> leading_name(std::string_view text, std::span<const std::string> names) {
  const std::size_t longest = longest_name(text);
  // Names are at most as long as the longest known name; patterns with stars may be shorter.
  std::size_t most = 0;
  for (const std::string& name : names) most = std::max(most, name.size());
  for (std::size_t length = std::min(longest, most); length > 0; --length) {
    const bool may_end = length == longest || text[length] == '/' || text[length] == '-';
    if (!may_end) continue;
    std::vector<NameMatch> matches = matching_names(text.substr(0, length), names);
    if (!matches.empty()) return LeadingName{length, std::move(matches)};
  }
  return std::nullopt;
}

std::string near_name(std::string_view word, std::span<const std::string> names) {
  if (word.empty() || word.size() > kLongestCompared) return "";
  // The end of a long name is the most specific part.
  for (const std::string& name : names) {
    if (name.size() > word.size() && name.ends_with(word) && name[name.size() - word.size() - 1] == '/')
      return "; did you mean '" + name + "'?";
  }
  const std::string* best = nullptr;
  std::size_t fewest = std::min(std::max<std::size_t>(1, word.size() / 3), word.size() - 1);
  for (const std::string& name : names) {
    if (name.size() > kLongestCompared) continue;
    const std::size_t count = edits(word, name, fewest);
    if (count > fewest || (best && count == fewest)) continue;
    best = &name;
    fewest = count;
  }
  return best ? "; did you mean '" + *best + "'?" : "";
}

namespace {

using Expression = Criterion::Expression;
using Kind = Expression::Kind;
using Relation = Expression::Relation;

// 1, 0, or NaN: a comparison with a number that does not exist is neither true nor false.
double compare(double a, Relation relation, double b) {
  if (std::isnan(a) || std::isnan(b)) return NAN;
  switch (relation) {
    case Relation::less:
      return a < b;
    case Relation::at_most:
      return a <= b;
    case Relation::greater:
      return a > b;
    case Relation::at_least:
      return a >= b;
    case Relation::equal:
      return a == b;
    case Relation::different:
      break;
  }
  return a != b;
}

// A number as a condition.
double truth(double value) { return std::isnan(value) ? value : value != 0 ? 1 : 0; }

// The minimum or maximum of three-valued conditions, 0 < NaN < 1: "and", "or".
double joined(std::span<const Expression> parts, std::span<const double> numbers, std::size_t pass, double decides) {
  double result = 1 - decides;
  for (const Expression& part : parts) {
    const double value = truth(value_of(part, numbers, pass));
    if (value == decides) return value;
    if (std::isnan(value)) result = value;
  }
  return result;
}

double extreme(const Expression& e, std::span<const double> numbers) {
  const bool least = e.kind == Kind::min;
  double best = least ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < e.operands.size(); ++i) {
    for (std::size_t pass = 0; pass < e.passes[i]; ++pass) {
      const double value = value_of(e.operands[i], numbers, pass);
      if (std::isnan(value)) return value;
      best = least ? std::min(best, value) : std::max(best, value);
    }
  }
  return best;
}

double sum(const Expression& e, std::span<const double> numbers, std::size_t pass) {
  double total = value_of(e.operands[0], numbers, pass);
  for (std::size_t i = 1; i < e.operands.size(); ++i) {
    const double value = value_of(e.operands[i], numbers, pass);
    total = e.inverse[i] ? total - value : total + value;
  }
  return total;
}

double product(const Expression& e, std::span<const double> numbers, std::size_t pass) {
  double total = value_of(e.operands[0], numbers, pass);
  for (std::size_t i = 1; i < e.operands.size(); ++i) {
    const double value = value_of(e.operands[i], numbers, pass);
    total = e.inverse[i] ? total / value : total * value;
  }
  return total;
}

double holds_in_all_passes(const Expression& e, std::span<const double> numbers) {
  double result = 1;
  for (std::size_t pass = 0; pass < e.passes[0]; ++pass) {
    const double left = value_of(e.operands[0], numbers, pass);
    const double holds =
        e.kind == Kind::condition ? truth(left) : compare(left, e.relation, value_of(e.operands[1], numbers, pass));
    if (holds == 0) return 0;
    if (std::isnan(holds)) result = holds;
  }
  return result;
}

Relation mirrored(Relation relation) {
  switch (relation) {
    case Relation::less:
      return Relation::greater;
    case Relation::at_most:
      return Relation::at_least;
    case Relation::greater:
      return Relation::less;
    case Relation::at_least:
      return Relation::at_most;
    default:
      return relation;
  }
}

// `side` at most or at least `bound`: the limits that follow for its numbers.
void collect_limit(const Expression& side, bool at_most, double bound, std::vector<CriterionLimit>& limits) {
  if (side.kind == Kind::name) {
    for (const std::size_t index : side.indices) limits.push_back({index, at_most, bound, false});
  } else if (side.kind == Kind::abs && side.operands[0].kind == Kind::name) {
    for (const std::size_t index : side.operands[0].indices) limits.push_back({index, at_most, bound, true});
  } else if (side.kind == (at_most ? Kind::max : Kind::min)) {
    for (const Expression& operand : side.operands) collect_limit(operand, at_most, bound, limits);
  }
}

// The known dimension of an expression. Plain numbers match any dimension.
struct Dimension {
  enum class Kind { any, known, unknown };
  Kind kind = Kind::any;
  std::array<int, 4> powers{};  // known: as of units
  bool is_stated = false;       // contains a number with a unit
  bool is_si = true;            // false: a name's numbers have a unit such as deg
  std::string text;             // for messages
};

class UnitCheck {
 public:
  UnitCheck(std::span<const std::string> names, std::span<const std::string> units) : names_(names), units_(units) {}

  Dimension of(const Expression& e) const {
    switch (e.kind) {
      case Kind::number:
        return e.unit.empty() ? Dimension() : of_number(e);
      case Kind::name:
        return of_names(e.indices);
      case Kind::product:
        return of_product(e);
      case Kind::negative:
      case Kind::abs:
      case Kind::condition:
        return of(e.operands.front());
      case Kind::sqrt: {
        Dimension root = of(e.operands.front());
        for (int& power : root.powers) power /= 2;
        root.text = "the square root";
        return root;
      }
      case Kind::all_of:
      case Kind::any_of:
      case Kind::none_of:
        for (const Expression& part : e.operands) of(part);
        return {};
      case Kind::comparison:
        of_equals(e, "compared with");
        return {};
      case Kind::sum:
        return of_equals(e, "added to");
      default:
        return of_equals(e, "put beside");
    }
  }

 private:
  static Dimension of_number(const Expression& e) {
    return {Dimension::Kind::known, unit_named(e.unit)->powers, true, true, "a number in '" + e.unit + "'"};
  }

  Dimension of_names(std::span<const std::size_t> indices) const {
    Dimension first = of_name(indices.front());
    for (const std::size_t index : indices) {
      if (index < units_.size() && units_[index] != units_[indices.front()])
        first.powers.fill(std::numeric_limits<int>::max()), first.text = "numbers of several units";  // fit nothing
    }
    return first;
  }

  Dimension of_name(std::size_t index) const {
    const std::optional<Unit> unit = index < units_.size() ? unit_named(units_[index]) : std::nullopt;
    if (!unit) return {Dimension::Kind::unknown, {}, false, true, ""};
    const bool is_si = unit->to_si.digits == "1" && unit->to_si.exponent == 0;
    return {
        Dimension::Kind::known, unit->powers, false, is_si,
        "'" + names_[index] + "' " + (units_[index] == "1" ? "(a number without unit)" : "(in " + units_[index] + ")")};
  }

  Dimension of_product(const Expression& e) const {
    Dimension all;
    for (std::size_t i = 0; i < e.operands.size(); ++i) {
      const Dimension one = of(e.operands[i]);
      all.is_stated = all.is_stated || one.is_stated;
      all.is_si = all.is_si && one.is_si;
      for (std::size_t k = 0; k < 4; ++k) all.powers[k] += e.inverse[i] ? -one.powers[k] : one.powers[k];
      if (one.kind != Dimension::Kind::any && all.kind != Dimension::Kind::unknown) all.kind = one.kind;
    }
    all.text = "a product or quotient";
    return all;
  }

  // Operands that must have the same dimension if a unit is written.
  Dimension of_equals(const Expression& e, const char* how) const {
    Dimension first;
    for (const Expression& operand : e.operands) {
      Dimension one = of(operand);
      if (one.kind == Dimension::Kind::any) continue;
      if (first.kind == Dimension::Kind::any) {
        first = std::move(one);
        continue;
      }
      first.is_stated = first.is_stated || one.is_stated;
      if (first.kind == Dimension::Kind::unknown || one.kind == Dimension::Kind::unknown) continue;
      if (first.is_stated && first.powers != one.powers)
        throw CriterionError(one.text + " cannot be " + how + " " + first.text, operand.begin);
      if (first.is_stated && !(first.is_si && one.is_si))
        throw CriterionError((first.is_si ? one.text : first.text) + " takes numbers in its unit, which is not written",
                             operand.begin);
    }
    return first;
  }

  std::span<const std::string> names_, units_;
};

}  // namespace

void check_units(const Expression& root, std::span<const std::string> names, std::span<const std::string> units) {
  UnitCheck(names, units).of(root);
}

double value_of(const Expression& e, std::span<const double> numbers, std::size_t pass) {
  switch (e.kind) {
    case Kind::number:
      return e.constant;
    case Kind::name:
      return numbers[e.indices.size() == 1 ? e.indices[0] : e.indices[pass]];
    case Kind::sum:
      return sum(e, numbers, pass);
    case Kind::product:
      return product(e, numbers, pass);
    case Kind::negative:
      return -value_of(e.operands[0], numbers, pass);
    case Kind::abs:
      return std::abs(value_of(e.operands[0], numbers, pass));
    case Kind::sqrt:
      return std::sqrt(value_of(e.operands[0], numbers, pass));
    case Kind::min:
    case Kind::max:
      return extreme(e, numbers);
    case Kind::comparison:
    case Kind::condition:
      return holds_in_all_passes(e, numbers);
    case Kind::all_of:
      return joined(e.operands, numbers, pass, 0);
    case Kind::any_of:
      return joined(e.operands, numbers, pass, 1);
    case Kind::none_of:
      break;
  }
  return 1 - truth(value_of(e.operands[0], numbers, pass));
}

void collect_reads(const Expression& e, std::vector<std::size_t>& reads) {
  reads.insert(reads.end(), e.indices.begin(), e.indices.end());
  for (const Expression& operand : e.operands) collect_reads(operand, reads);
}

void collect_limits(const Expression& e, std::vector<CriterionLimit>& limits) {
  if (e.kind == Kind::all_of) {
    for (const Expression& part : e.operands) collect_limits(part, limits);
    return;
  }
  if (e.kind != Kind::comparison) return;
  for (const std::size_t side : {0, 1}) {
    std::vector<std::size_t> reads;
    collect_reads(e.operands[1 - side], reads);
    if (!reads.empty()) continue;
    const Relation relation = side == 0 ? e.relation : mirrored(e.relation);
    const double bound = value_of(e.operands[1 - side], {}, 0);
    if (relation == Relation::less || relation == Relation::at_most)
      collect_limit(e.operands[side], true, bound, limits);
    else if (relation == Relation::greater || relation == Relation::at_least)
      collect_limit(e.operands[side], false, bound, limits);
  }
}

}  // namespace grapnel
