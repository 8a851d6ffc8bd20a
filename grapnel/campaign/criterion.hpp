#pragma once

/// @file
/// A condition on the numbers of a row: "grasps/*/impulse_magnitude < 0.5 and captured".

#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/result/ledger.hpp"

namespace grapnel {

/// Error in an expression, with its position in the text.
struct CriterionError : std::runtime_error {
  CriterionError(std::string message, std::size_t at) : std::runtime_error(std::move(message)), offset(at) {}
  std::size_t offset;  // of the first wrong character, from 0
};

/// Limit of a criterion on a single number, if it can be expressed so: "a < 0.5" and "abs(a) <= 0.5", also as parts of
/// an `and`.
struct CriterionLimit {
  std::size_t number = 0;  // index
  bool at_most = true;     // false: at least
  double bound = 0;
  bool magnitude = false;  // of the number's magnitude
};

class Criterion {
 public:
  static constexpr std::size_t kLongest = 10000;  // bytes of text
  static constexpr int kDeepest = 100;            // nested parentheses, functions and signs

  /// Parses `text` over the numbers called `names` (of a campaign: the columns, then the inputs; of equal names the
  /// first counts), in `units`; empty: unknown, or compared before. `name`: for results; the text
  /// if empty.
  ///
  /// Operators, from loosest to tightest: or; and; not; < <= > >= == != (not chained); + -; * /; unary + -. Operands:
  /// numbers, names, parentheses, abs(x), sqrt(x), min(x, ...), max(x, ...). Numbers have their columns' units, or an
  /// explicit unit, "0.2 N s", which converts them to SI; the other operand of a comparison or sum must then have the
  /// same dimension.
  ///
  /// Names need no quotes: at the position of an operand, the longest known name is used that ends at the next other
  /// character or before a - or a /. So `a/b` is the column a/b if there is one, else a divided by b. Names with
  /// characters other than letters, digits, _ . - / need backquotes.
  ///
  /// `*` as a whole part of a name, between slashes, means all names that match. A comparison, or a name as a
  /// condition, must then hold for every one; min and max use all of them. Several such names in one comparison, or in
  /// one argument of min or max, are expanded together over the same parts: "grasps/*/mean_force <
  /// grasps/*/peak_force".
  ///
  /// A number as a condition is true unless it is 0; a condition as a number is 1 or 0. NaN, a comparison with NaN, and
  /// their negations are neither true nor false; a criterion holds only if it is true. min and max of a NaN are NaN.
  /// @throws CriterionError
  static Criterion parse(const std::string& text, std::span<const std::string> names, const std::string& name = "",
                         std::span<const std::string> units = {});

  /// Whether it holds for numbers in the order of the names; not_checked if the result depends on a number that does
  /// not exist.
  Verdict judge(std::span<const double> numbers) const;
  bool holds(std::span<const double> numbers) const { return judge(numbers) == Verdict::yes; }
  const std::string& text() const { return text_; }
  const std::string& name() const { return name_; }
  /// Indices of the numbers it reads, increasing.
  const std::vector<std::size_t>& reads() const { return reads_; }
  const std::vector<CriterionLimit>& limits() const { return limits_; }

  struct Expression;

 private:
  std::string text_, name_;
  std::vector<std::size_t> reads_;
  std::vector<CriterionLimit> limits_;
  std::shared_ptr<const Expression> root_;
};

}  // namespace grapnel
