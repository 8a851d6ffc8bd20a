#pragma once

/// @file
/// What of a number's variance an uncertain input explains, from one and the same sample.

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
  /// With the ranking known.
  RankedNumbers(std::span<const double> numbers, const Ranking& ranking);

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

/// The same of plain numbers; pairs with one that is not finite are left out. O(n log n).
Sensitivity sensitivity_of(std::span<const double> x, std::span<const double> y);

}  // namespace grapnel
