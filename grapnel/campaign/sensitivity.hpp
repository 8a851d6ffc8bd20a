#pragma once

/// @file
/// What of a number's variance an uncertain input, or several together, explain, from one and the same sample.

#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/campaign/statistics.hpp"

namespace grapnel {

/// The first-order Sobol index Var(E[y|x]) / Var(y) of an input, and Spearman's rank correlation. NaN with fewer than
/// four pairs, or where x or y is constant.
struct Sensitivity {
  double first_order = 0;  // may be slightly negative by chance
  double error = 0;        // its standard error, as if drawn at random
  double rank_correlation = 0;
};

/// A number that is compared with inputs: what each comparison needs is made once.
struct RankedNumbers {
  explicit RankedNumbers(std::span<const double> numbers);

  struct Item {
    double number, rank;
  };
  std::vector<Item> items;  // per row; NaN where the number is not finite
  std::size_t count = 0;    // of finite ones
  double mean = 0;          // of the finite ones
};

/// Numbers are sorted by x and made into groups of about n^(1/3) neighbours. Means of next groups have E[y|x] in common
/// and nothing else, so that half of their mean squared difference is what chance adds to the variance of the means:
/// with groups of one this is the estimator of Gamboa, Gremaud, Klein and Lagnoux (2022, Bernoulli 28, eq. 10). Larger
/// groups lessen the noise, of order (n * group)^(-1/2) where x has no influence, and do not mind that next points of
/// an evenly spread sample (Sobol's sequence) differ systematically in the other inputs, which ruins single neighbours.
///
/// `x`: the ranking of the input, which is finite wherever y is. O(n). The error is that of the efficient influence
/// function 2 y f - f^2 - S y^2, f = E[y|x] (Da Veiga and Gamboa 2013), with f from the groups beside.
Sensitivity sensitivity_of(const Ranking& x, const RankedNumbers& y);

/// The variance of a number that goes with a group of inputs: Var(E[y|x1 ... xd]) / Var(y), of which neighbours in many
/// dimensions tell little, as far as a quadratic function of the inputs has it. That is the share of the variance of
/// the least squares fit, less what chance adds to it (adjusted R^2, Ezekiel 1930): a lower bound but for chance, exact
/// for what is quadratic, a half to nine tenths of what is yes or no.
class GroupSensitivity {
 public:
  /// Of groups with more inputs no products are in the fit.
  static constexpr std::size_t kMostCrossed = 12;

  /// `inputs`: of each its numbers, all with as many rows.
  explicit GroupSensitivity(const std::vector<std::vector<double>>& inputs);

  /// Of one number, NaN where it does not exist. The error is that of a squared multiple correlation (Olkin and Finn
  /// 1995). NaN where y is constant or rows are fewer than ten and twice the terms of the fit. No rank correlation.
  Sensitivity of(std::span<const double> y);

 private:
  void fit_rows(const std::vector<std::uint8_t>& used);

  std::vector<std::vector<double>> terms_;  // per term its numbers; NaN where an input does not exist
  std::vector<std::uint8_t> used_;          // rows of `basis_`
  std::vector<std::vector<double>> basis_;  // orthonormal, of the rows used, without their means
};

}  // namespace grapnel
