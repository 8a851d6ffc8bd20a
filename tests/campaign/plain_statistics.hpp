#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "grapnel/campaign/statistics.hpp"

namespace grapnel::test {

/// Describes numbers in any order.
inline Description describe_numbers(std::span<const double> numbers, std::span<const double> probabilities) {
  std::vector<double> sorted;
  std::copy_if(numbers.begin(), numbers.end(), std::back_inserter(sorted), [](double x) { return std::isfinite(x); });
  std::sort(sorted.begin(), sorted.end());
  return describe_sorted(sorted, numbers.size() - sorted.size(), probabilities, 0.95);
}

/// The pairs whose numbers are both finite.
struct Pairs {
  std::vector<double> x, y;
};
inline Pairs finite_pairs(std::span<const double> x, std::span<const double> y) {
  Pairs pairs;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    pairs.x.push_back(x[i]);
    pairs.y.push_back(y[i]);
  }
  return pairs;
}

inline Sensitivity sensitivity_of(std::span<const double> x, std::span<const double> y) {
  const Pairs pairs = finite_pairs(x, y);
  return grapnel::sensitivity_of(ranking_of(pairs.x), RankedNumbers(pairs.y));
}

/// Spearman's rank correlation by its definition: Pearson's correlation of the ranks.
inline double rank_correlation(std::span<const double> x, std::span<const double> y) {
  const Pairs pairs = finite_pairs(x, y);
  const std::size_t n = pairs.x.size();
  const std::vector<double> a = mean_ranks(ranking_of(pairs.x), n), b = mean_ranks(ranking_of(pairs.y), n);
  const double mean = 0.5 * (static_cast<double>(n) + 1);
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < n; ++i) {
    aa += (a[i] - mean) * (a[i] - mean);
    bb += (b[i] - mean) * (b[i] - mean);
    ab += (a[i] - mean) * (b[i] - mean);
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace grapnel::test
