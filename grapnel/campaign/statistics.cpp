#include "grapnel/campaign/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/campaign/uncertain_value.hpp"

namespace grapnel {
namespace {

// A bijection of 32 bits without visible pattern (finalizer of MurmurHash3, Appleby).
std::uint32_t scattered(std::uint32_t i) {
  i ^= i >> 16;
  i *= 0x85ebca6bu;
  i ^= i >> 13;
  i *= 0xc2b2ae35u;
  return i ^ (i >> 16);
}

// Sum with the rounding errors carried along (Neumaier 1974).
class Sum {
 public:
  void add(double x) {
    const double sum = sum_ + x;
    rest_ += std::abs(sum_) >= std::abs(x) ? (sum_ - sum) + x : (x - sum) + sum_;
    sum_ = sum;
  }
  double value() const { return std::isfinite(sum_) ? sum_ + rest_ : sum_; }

 private:
  double sum_ = 0, rest_ = 0;
};

double quantile_of_sorted(std::span<const double> sorted, double p) {
  if (sorted.empty()) return NAN;
  const double at = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(sorted.size() - 1)));
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = at - static_cast<double>(below);
  // Not a + part (b - a): the difference of large numbers of both signs need not be finite.
  return sorted[below] == sorted[above] ? sorted[below] : (1 - part) * sorted[below] + part * sorted[above];
}

}  // namespace

Proportion wilson(std::uint64_t successes, std::uint64_t trials, double confidence) {
  Proportion p{successes, trials, NAN, 0, 1};
  if (trials == 0) return p;
  const double n = static_cast<double>(trials);
  const double z = normal_quantile(0.5 + confidence / 2);
  p.estimate = static_cast<double>(successes) / n;
  const double scale = 1 / (1 + z * z / n);
  const double middle = scale * (p.estimate + z * z / (2 * n));
  const double half = scale * z * std::sqrt(p.estimate * (1 - p.estimate) / n + z * z / (4 * n * n));
  // The ends are exact where the estimate is at one.
  p.lower = successes == 0 ? 0 : std::max(0.0, middle - half);
  p.upper = successes == trials ? 1 : std::min(1.0, middle + half);
  return p;
}

Ranking ranking_of(std::span<const double> numbers) {
  if (numbers.size() >= std::numeric_limits<std::uint32_t>::max())
    throw std::length_error("statistics are of at most 4294967294 rows");
  struct Item {
    double number;
    std::uint32_t index;
  };
  std::vector<Item> items;
  items.reserve(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (std::isfinite(numbers[i])) items.push_back({numbers[i], static_cast<std::uint32_t>(i)});
  }
  std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
    return a.number != b.number ? a.number < b.number : scattered(a.index) < scattered(b.index);
  });
  Ranking ranking;
  ranking.order.reserve(items.size());
  ranking.same.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    ranking.order.push_back(items[i].index);
    ranking.same.push_back(i > 0 && items[i].number == items[i - 1].number);
  }
  return ranking;
}

std::vector<double> mean_ranks(const Ranking& ranking, std::size_t size) {
  std::vector<double> ranks(size, NAN);
  const std::size_t n = ranking.order.size();
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    while (end < n && ranking.same[end]) ++end;
    const double rank = 0.5 * static_cast<double>(begin + 1 + end);
    for (std::size_t i = begin; i < end; ++i) ranks[ranking.order[i]] = rank;
    begin = end;
  }
  return ranks;
}

QuantileRanks quantile_ranks(std::uint64_t n, double p, double confidence) {
  if (!(p > 0 && p < 1)) return {-1, static_cast<std::int64_t>(n)};
  // How many of n are below the quantile is binomial. Its probabilities relative to the largest, within twelve standard
  // deviations of the mean: beyond are less than 1e-30.
  const double mean = static_cast<double>(n) * p;
  const double reach = 12 * std::sqrt(mean * (1 - p)) + 40;
  const auto first = static_cast<std::uint64_t>(std::max(0.0, std::floor(mean - reach)));
  const auto last = std::min(n, static_cast<std::uint64_t>(std::ceil(mean + reach)));
  const auto mode = std::clamp(static_cast<std::uint64_t>(mean), first, last);
  std::vector<double> weight(last - first + 1, 0.0);
  weight[mode - first] = 1;
  const double odds = p / (1 - p);
  for (std::uint64_t k = mode; k < last; ++k)
    weight[k + 1 - first] = weight[k - first] * odds * static_cast<double>(n - k) / static_cast<double>(k + 1);
  for (std::uint64_t k = mode; k > first; --k)
    weight[k - 1 - first] = weight[k - first] / odds * static_cast<double>(k) / static_cast<double>(n - k + 1);
  double total = 0;
  for (const double w : weight) total += w;
  const double beyond = (1 - confidence) / 2 * total;
  QuantileRanks ranks{-1, static_cast<std::int64_t>(n)};
  // The order statistic at position l (from 0) is above the quantile if at most l numbers are below it.
  double tail = 0;
  for (std::uint64_t k = first; k <= last && (tail += weight[k - first]) <= beyond; ++k)
    ranks.lower = static_cast<std::int64_t>(k);
  // That at position u is below the quantile if more than u numbers are.
  tail = 0;
  for (std::uint64_t k = last; k > first && (tail += weight[k - first]) <= beyond; --k)
    ranks.upper = static_cast<std::int64_t>(k) - 1;
  // Weights outside of first ... last are nothing, and yet order statistics may be there.
  if (ranks.lower < 0 && first > 0) ranks.lower = static_cast<std::int64_t>(first) - 1;
  if (ranks.upper == static_cast<std::int64_t>(n) && last < n) ranks.upper = static_cast<std::int64_t>(last);
  return ranks;
}

Description describe_sorted(std::span<const double> sorted, std::uint64_t missing,
                            std::span<const double> probabilities, double confidence) {
  Description d{sorted.size(), missing, NAN, NAN, NAN, NAN, NAN, {}};
  if (!sorted.empty()) {
    const double n = static_cast<double>(sorted.size());
    Sum sum, squares;
    // About the middle one, so that the mean of equal numbers is that number.
    const double middle = sorted[sorted.size() / 2];
    for (const double x : sorted) sum.add((x - middle) / n);
    d.mean = std::clamp(middle + sum.value(), sorted.front(), sorted.back());
    for (const double x : sorted) squares.add((x - d.mean) * (x - d.mean));
    if (sorted.size() > 1) {
      d.standard_deviation = std::sqrt(squares.value() / (n - 1));
      d.mean_error = d.standard_deviation / std::sqrt(n);
    }
    d.least = sorted.front();
    d.largest = sorted.back();
  }
  for (const double p : probabilities) {
    const QuantileRanks ranks = quantile_ranks(sorted.size(), p, confidence);
    const auto at = [&](std::int64_t i) {
      return i < 0 || i >= static_cast<std::int64_t>(sorted.size()) ? NAN : sorted[static_cast<std::size_t>(i)];
    };
    d.quantiles.push_back({p, quantile_of_sorted(sorted, p), at(ranks.lower), at(ranks.upper)});
  }
  return d;
}

namespace {

constexpr double kMostWhole = 40;
constexpr double kFewestBins = 10, kMostBins = 60;

bool are_whole(std::span<const double> sorted) {
  return sorted.back() - sorted.front() < kMostWhole && std::abs(sorted.front()) < 1e9 &&
         std::all_of(sorted.begin(), sorted.end(), [](double x) { return x == std::floor(x); });
}

// Where the bins are.
Histogram bins_for(std::span<const double> sorted) {
  Histogram h{sorted.front(), sorted.back(), {}, 0, 0};
  if (are_whole(sorted)) {
    const auto bins = static_cast<std::size_t>(h.end - h.begin) + 1;
    return {h.begin - 0.5, h.end + 0.5, std::vector<std::uint64_t>(bins, 0), 0, 0};
  }
  constexpr double kFar = 4, kOutside = 0.005, kMargin = 0.1;
  const double low = quantile_of_sorted(sorted, kOutside), high = quantile_of_sorted(sorted, 1 - kOutside);
  const double middle = high - low;
  if (middle > 0 && h.end - h.begin > kFar * middle) {
    h.begin = std::max(h.begin, low - kMargin * middle);
    h.end = std::min(h.end, high + kMargin * middle);
  }
  const double quartiles = quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25);
  const double width = 2 * quartiles / std::cbrt(static_cast<double>(sorted.size()));
  const double asked = width > 0 ? (h.end - h.begin) / width : kMostBins;
  const double bins = std::isfinite(asked) ? std::clamp(std::ceil(asked), kFewestBins, kMostBins) : kMostBins;
  h.counts.assign(static_cast<std::size_t>(bins), 0);
  return h;
}

}  // namespace

std::int64_t Histogram::bin_of(double number) const {
  if (number < begin) return -1;
  const auto bins = static_cast<std::int64_t>(counts.size());
  if (number > end) return bins;
  // Halved, so that the range of any two doubles is finite.
  const double part = begin == end ? 0 : (number / 2 - begin / 2) / (end / 2 - begin / 2);
  return std::clamp(static_cast<std::int64_t>(part * static_cast<double>(bins)), std::int64_t{0}, bins - 1);
}

Histogram histogram_of_sorted(std::span<const double> sorted) {
  if (sorted.empty()) return {};
  Histogram h =
      sorted.front() == sorted.back() ? Histogram{sorted.front(), sorted.back(), {0}, 0, 0} : bins_for(sorted);
  for (const double x : sorted) {
    const std::int64_t bin = h.bin_of(x);
    if (bin < 0)
      ++h.below;
    else if (bin >= static_cast<std::int64_t>(h.counts.size()))
      ++h.above;
    else
      ++h.counts[static_cast<std::size_t>(bin)];
  }
  return h;
}

}  // namespace grapnel
