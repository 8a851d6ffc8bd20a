#pragma once

/// @file
/// What a campaign's numbers say: probabilities with intervals, means, quantiles, histograms, correlations. Each is a
/// free function on plain numbers; what is not finite is left out, and counted.

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
  std::vector<std::uint32_t> order;  // indices of the finite numbers, the least first
  std::vector<std::uint8_t> same;    // 1: as large as the one before it in `order`
};
/// Equal numbers come in a pseudo-random order that depends on their indices alone: consecutive points of an evenly
/// spread sample are not neighbours in disguise. O(n log n). @throws std::length_error
Ranking ranking_of(std::span<const double> numbers);
/// Rank of every number from 1, equal ones their mean rank; NaN for what is not finite.
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
  std::vector<QuantileEstimate> quantiles;  // at the asked probabilities
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
/// Freedman and Diaconis (1981) have them, over all numbers; but over the middle 99 % and a tenth of it on either side
/// where all numbers take more than four times as much.
Histogram histogram_of_sorted(std::span<const double> sorted);

}  // namespace grapnel
