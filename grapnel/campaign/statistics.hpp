#pragma once

/// @file
/// Statistics of a campaign's numbers: probabilities with intervals, means, quantiles, histograms, correlations,
/// sensitivity to uncertain inputs. Free functions on plain numbers; non-finite values are excluded and counted.

#include <cstdint>
#include <span>
#include <vector>

namespace grapnel {

/// A probability estimated from successes among trials.
struct Proportion {
  std::uint64_t successes = 0, trials = 0;
  double estimate = 0;          // successes / trials; NaN without trials
  double lower = 0, upper = 1;  // Wilson's score interval
};
/// Wilson (1927), at two-sided confidence `confidence` (between 0 and 1). Without trials: 0 to 1.
Proportion wilson(std::uint64_t successes, std::uint64_t trials, double confidence = 0.95);

/// The order of numbers, found once and used for all that needs it. For at most 2^32 - 2 numbers.
struct Ranking {
  std::vector<std::uint32_t> order;  // indices of the finite numbers, in ascending order of the numbers
  std::vector<std::uint8_t> same;    // 1: equal to the previous number in `order`
};
/// Equal numbers come in a pseudo-random order that depends on their indices alone: consecutive points of an evenly
/// spread sample do not remain neighbours. O(n). @throws std::length_error
Ranking ranking_of(std::span<const double> numbers);
/// Rank of every number from 1, the mean rank for equal numbers; NaN for non-finite numbers.
std::vector<double> mean_ranks(const Ranking& ranking, std::size_t size);

struct QuantileEstimate {
  double probability = 0;
  double value = 0;  // between order statistics, linearly (Hyndman and Fan 1996, type 7)
  /// Order statistics that enclose the quantile with the confidence at least, for any continuous distribution; NaN if
  /// the sample is too small for one.
  double lower = 0, upper = 0;
};

/// Of numbers; NaN where there are too few.
struct Description {
  std::uint64_t count = 0, missing = 0;  // finite numbers; others
  double mean = 0;
  double mean_error = 0;          // standard error of the mean, as if drawn at random
  double standard_deviation = 0;  // with n - 1
  double least = 0, largest = 0;
  std::vector<QuantileEstimate> quantiles;  // at the requested probabilities
};
/// Of numbers in increasing order, all finite.
Description describe_sorted(std::span<const double> sorted, std::uint64_t missing,
                            std::span<const double> probabilities, double confidence);

/// Positions, from 0, of the order statistics among n whose interval encloses the quantile of probability p with the
/// confidence at least, (1 - confidence) / 2 at most beyond either side; -1 and n where there is none.
struct QuantileRanks {
  std::int64_t lower = -1, upper = 0;
};
QuantileRanks quantile_ranks(std::uint64_t n, double p, double confidence);

struct Histogram {
  double begin = 0, end = 0;           // bins of equal width in between; the last includes its end
  std::vector<std::uint64_t> counts;   // one bin of width 0 if all are the same; none without numbers
  std::uint64_t below = 0, above = 0;  // outside
  /// The bin of a finite number; -1 or counts.size() outside.
  std::int64_t bin_of(double number) const;
};
/// Of numbers in increasing order, all finite. Whole numbers over less than 40 have a bin each. Else 10 to 60 bins as
/// of Freedman and Diaconis (1981), over all numbers; if the range of all numbers is more than four times that of the
/// middle 99 %, over the middle 99 % and a tenth of it on either side.
Histogram histogram_of_sorted(std::span<const double> sorted);

// Variance of a number explained by an uncertain input, or by several together, from one sample.

/// The first-order Sobol index Var(E[y|x]) / Var(y) of an input, and Spearman's rank correlation. NaN with fewer than
/// four pairs, or where x or y is constant.
struct Sensitivity {
  double first_order = 0;  // may be slightly negative by chance
  double error = 0;        // its standard error, as if drawn at random
  double rank_correlation = 0;
};

/// A number for comparisons with inputs; common data is prepared once.
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
/// and nothing else, so that half of their mean squared difference is the contribution of chance to the variance of the
/// means: with groups of one this is the estimator of Gamboa, Gremaud, Klein and Lagnoux (2022, Bernoulli 28, eq. 10).
/// Larger groups reduce the noise, of order (n * group)^(-1/2) where x has no influence, and are insensitive to the
/// systematic differences of successive points of an evenly spread sample (Sobol's sequence) in the other inputs, which
/// make single neighbours unusable.
///
/// `x`: the ranking of the input, which is finite wherever y is. O(n). The error is that of the efficient influence
/// function 2 y f - f^2 - S y^2, f = E[y|x] (Da Veiga and Gamboa 2013), with f from the groups beside.
Sensitivity sensitivity_of(const Ranking& x, const RankedNumbers& y);

/// The variance of a number explained by a group of inputs, Var(E[y|x1 ... xd]) / Var(y), approximated by a quadratic
/// function of the inputs, because neighbours in many dimensions are not informative. It is the share of the variance
/// of the least squares fit, corrected for chance (adjusted R^2, Ezekiel 1930): a lower bound except for chance, exact
/// for quadratic functions, a half to nine tenths for yes/no values.
class GroupSensitivity {
 public:
  /// For groups with more inputs the fit has no products.
  static constexpr std::size_t kMostCrossed = 12;

  /// `inputs`: the numbers of each input, all with the same number of rows.
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
