#pragma once

/// @file
/// What a criterion is made of: the names of a row's numbers as it writes them, and its tree. For criterion*.cpp.
/// Thread safety: plain values; evaluation is pure.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/campaign/criterion.hpp"

namespace grapnel {

/// One of the names that a pattern matches.
struct NameMatch {
  std::vector<std::string> stars;  // what each `*` stands for
  std::size_t index = 0;           // of the name
};

/// All names that a name with `*` as whole parts matches, in the order of what the stars stand for; of equal names the
/// first. Without a `*`: that name itself, or nothing.
std::vector<NameMatch> matching_names(std::string_view pattern, std::span<const std::string> names);

/// A name that a criterion's text begins with.
struct LeadingName {
  std::size_t length = 0;  // bytes of the text
  std::vector<NameMatch> matches;
};

/// How many bytes at the beginning of `text` a name without backquotes can have at most; 0 if none begins there.
std::size_t longest_name(std::string_view text);

/// The longest beginning of `text` that matches and ends where a name may end; empty if there is none.
std::optional<LeadingName> leading_name(std::string_view text, std::span<const std::string> names);

/// "; did you mean 'a/b'?" for a name that is not there, or nothing if none is near.
std::string near_name(std::string_view word, std::span<const std::string> names);

/// A node: what it computes from its operands.
struct Criterion::Expression {
  enum class Kind {
    number,      // `constant`
    name,        // the number at `indices[pass]`, or at `indices[0]` if there is only one
    sum,         // operands, those with `inverse` subtracted
    product,     // operands, those with `inverse` divided by
    negative,    // -operand
    abs,         //
    sqrt,        //
    min,         // of all operands in all their passes
    max,         //
    comparison,  // operands[0] `relation` operands[1] in all passes
    condition,   // operands[0] is not 0, in all passes
    all_of,      // and
    any_of,      // or
    none_of,     // not: one operand
  };
  enum class Relation { less, at_most, greater, at_least, equal, different };

  Kind kind = Kind::number;
  Relation relation = Relation::less;
  double constant = 0;                          // of a number; in SI if it has a unit
  std::string unit;                             // as a number has it in the text, or none
  std::size_t begin = 0;                        // where it stands in the text
  std::vector<std::size_t> indices;             // of a name; several for one with stars
  std::vector<std::vector<std::string>> stars;  // of a name with stars: what they stand for, per index
  std::vector<Expression> operands;
  std::vector<bool> inverse;        // per operand
  std::vector<std::size_t> passes;  // min, max: per operand; comparison, condition: one
};

/// Checks that numbers with units are compared with, and added to, values of their dimension. `units`: of the names, or
/// none. @throws CriterionError
void check_units(const Criterion::Expression& root, std::span<const std::string> names,
                 std::span<const std::string> units);

/// Its number in a pass; conditions give 1 or 0, or NaN where a number that does not exist decides.
double value_of(const Criterion::Expression& e, std::span<const double> numbers, std::size_t pass);

/// Appends the indices it reads.
void collect_reads(const Criterion::Expression& e, std::vector<std::size_t>& reads);

/// Appends what a condition asks of single numbers.
void collect_limits(const Criterion::Expression& e, std::vector<CriterionLimit>& limits);

}  // namespace grapnel
