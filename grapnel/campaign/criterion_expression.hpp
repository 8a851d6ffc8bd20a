#pragma once

/// @file
/// Parts of a criterion: names of a row's numbers, and the expression tree. For criterion*.cpp.
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
  std::vector<std::string> stars;  // text matched by each `*`
  std::size_t index = 0;           // of the name
};

/// All names that match a name with `*` as whole parts, in the order of the texts matched by the stars; of equal names
/// the first. Without a `*`: that name, or nothing.
std::vector<NameMatch> matching_names(std::string_view pattern, std::span<const std::string> names);

/// A name at the beginning of a criterion's text.
struct LeadingName {
  std::size_t length = 0;  // bytes of the text
  std::vector<NameMatch> matches;
};

/// Largest number of bytes of a name without backquotes at the beginning of `text`; 0 if none begins there.
std::size_t longest_name(std::string_view text);

/// The longest prefix of `text` that matches and ends at a possible end of a name; empty if there is none.
std::optional<LeadingName> leading_name(std::string_view text, std::span<const std::string> names);

/// "; did you mean 'a/b'?" for an unknown name, or nothing if no name is similar.
std::string near_name(std::string_view word, std::span<const std::string> names);

/// A node of the expression tree.
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
  std::string unit;                             // of a number, as in the text; empty: none
  std::size_t begin = 0;                        // position in the text
  std::vector<std::size_t> indices;             // of a name; several for one with stars
  std::vector<std::vector<std::string>> stars;  // of a name with stars: the matched texts, per index
  std::vector<Expression> operands;
  std::vector<bool> inverse;        // per operand
  std::vector<std::size_t> passes;  // min, max: per operand; comparison, condition: one
};

/// Checks that numbers with units are compared with, and added to, values of their dimension. `units`: of the names, or
/// none. @throws CriterionError
void check_units(const Criterion::Expression& root, std::span<const std::string> names,
                 std::span<const std::string> units);

/// Its number in a pass; conditions give 1 or 0, or NaN if the result depends on a number that does not exist.
double value_of(const Criterion::Expression& e, std::span<const double> numbers, std::size_t pass);

/// Appends the indices it reads.
void collect_reads(const Criterion::Expression& e, std::vector<std::size_t>& reads);

/// Appends the limits of a condition on single numbers.
void collect_limits(const Criterion::Expression& e, std::vector<CriterionLimit>& limits);

}  // namespace grapnel
