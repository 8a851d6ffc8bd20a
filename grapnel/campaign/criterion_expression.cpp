#include "grapnel/campaign/criterion_expression.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

using Expression = Criterion::Expression;
using Kind = Expression::Kind;
using Relation = Expression::Relation;

// 1, 0, or NaN: what compares with a number that does not exist is neither true nor false.
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

// The least of three-valued conditions, 0 < NaN < 1, or the largest: "and", "or".
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

// `side` at most or at least `bound`: what that says of each of its numbers.
void collect_limit(const Expression& side, bool at_most, double bound, std::vector<CriterionLimit>& limits) {
  if (side.kind == Kind::name) {
    for (const std::size_t index : side.indices) limits.push_back({index, at_most, bound, false});
  } else if (side.kind == Kind::abs && side.operands[0].kind == Kind::name) {
    for (const std::size_t index : side.operands[0].indices) limits.push_back({index, at_most, bound, true});
  } else if (side.kind == (at_most ? Kind::max : Kind::min)) {
    for (const Expression& operand : side.operands) collect_limit(operand, at_most, bound, limits);
  }
}

}  // namespace

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
