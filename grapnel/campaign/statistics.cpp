#include "grapnel/campaign/statistics.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

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
  // Not a + part (b - a): the difference of large numbers of opposite signs may overflow.
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
  // The ends are exact if the estimate is 0 or 1.
  p.lower = successes == 0 ? 0 : std::max(0.0, middle - half);
  p.upper = successes == trials ? 1 : std::min(1.0, middle + half);
  return p;
}

namespace {

// A finite number to sort, and its index.
struct Ranked {
  std::uint64_t key;
  std::uint32_t index;
};

// Monotonic in the number, equal for both zeros.
std::uint64_t key_of(double number) {
  const auto bits = std::bit_cast<std::uint64_t>(number + 0.0);
  return bits >> 63 != 0 ? ~bits : bits | std::uint64_t{1} << 63;
}

// Sorts by keys and leaves equal ones in their order: by digits of 11 bits, the least first, in as many passes as
// digits differ. A comparison sort of 100,000 numbers takes five times as long, and campaigns sort every column.
void sort_by_keys(std::vector<Ranked>& items) {
  constexpr int kDigitBits = 11, kDigits = 6;
  constexpr std::size_t kSize = std::size_t{1} << kDigitBits;
  std::vector<std::array<std::uint32_t, kSize>> counts(kDigits);
  for (const Ranked& item : items) {
    for (int d = 0; d < kDigits; ++d) ++counts[static_cast<std::size_t>(d)][item.key >> d * kDigitBits & (kSize - 1)];
  }
  std::vector<Ranked> sorted(items.size());
  for (int d = 0; d < kDigits; ++d) {
    std::array<std::uint32_t, kSize>& count = counts[static_cast<std::size_t>(d)];
    const auto digit = [&](const Ranked& item) { return item.key >> d * kDigitBits & (kSize - 1); };
    if (items.empty() || count[digit(items[0])] == items.size()) continue;
    std::uint32_t begin = 0;
    for (std::uint32_t& of_digit : count) begin += std::exchange(of_digit, begin);
    for (const Ranked& item : items) sorted[count[digit(item)]++] = item;
    items.swap(sorted);
  }
}

}  // namespace

Ranking ranking_of(std::span<const double> numbers) {
  if (numbers.size() >= std::numeric_limits<std::uint32_t>::max())
    throw std::length_error("statistics are of at most 4294967294 rows");
  // Equal numbers in the order of their scattered indices, then all in the order of the numbers.
  std::vector<Ranked> items;
  items.reserve(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    if (std::isfinite(numbers[i])) items.push_back({scattered(index), index});
  }
  sort_by_keys(items);
  for (Ranked& item : items) item.key = key_of(numbers[item.index]);
  sort_by_keys(items);
  Ranking ranking;
  ranking.order.reserve(items.size());
  ranking.same.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    ranking.order.push_back(items[i].index);
    ranking.same.push_back(i > 0 && items[i].key == items[i - 1].key);
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
  // Weights outside of first ... last are negligible, but order statistics may be there.
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
    // About the median, so that the mean of equal numbers is that number.
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

// The range of the bins.
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

namespace {

constexpr std::size_t kFewest = 4;

struct Group {
  std::size_t begin = 0, end = 0;
  double mean = 0;
};

// Consecutive groups of about the cube root of their number, all of the same size or one more.
std::vector<Group> groups_of(std::span<const double> y) {
  const std::size_t n = y.size();
  const auto size = std::max<std::size_t>(1, static_cast<std::size_t>(std::cbrt(static_cast<double>(n)) + 1e-9));
  std::vector<Group> groups(n / size);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    groups[i] = {i * n / groups.size(), (i + 1) * n / groups.size(), 0};
    for (std::size_t j = groups[i].begin; j < groups[i].end; ++j) groups[i].mean += y[j];
    groups[i].mean /= static_cast<double>(groups[i].end - groups[i].begin);
  }
  return groups;
}

// `y` in the order of x, minus its mean.
void first_order_of(std::span<const double> y, Sensitivity& s) {
  const double n = static_cast<double>(y.size());
  double variance = 0;
  for (const double value : y) variance += value * value;
  variance /= n - 1;
  const std::vector<Group> groups = groups_of(y);
  const double count = static_cast<double>(groups.size());
  double between = 0, noise = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    between += static_cast<double>(groups[i].end - groups[i].begin) / n * groups[i].mean * groups[i].mean;
    if (i == 0) continue;
    const double difference = groups[i].mean - groups[i - 1].mean;
    noise += 0.5 * difference * difference / (count - 1);
  }
  between *= count / (count - 1);
  s.first_order = (between - noise) / variance;

  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double before = groups[i == 0 ? 1 : i - 1].mean;
    const double after = groups[i + 1 == groups.size() ? i - 1 : i + 1].mean;
    const double f = 0.5 * (before + after);
    for (std::size_t j = groups[i].begin; j < groups[i].end; ++j) {
      const double influence = 2 * y[j] * f - f * f - s.first_order * y[j] * y[j];
      sum += influence;
      squares += influence * influence;
    }
  }
  s.error = std::sqrt(std::max(0.0, squares - sum * sum / n)) / n / variance;
}

}  // namespace

RankedNumbers::RankedNumbers(std::span<const double> numbers) : items(numbers.size(), Item{NAN, NAN}) {
  const Ranking ranking = ranking_of(numbers);
  count = ranking.order.size();
  const std::vector<double> ranks = mean_ranks(ranking, numbers.size());
  // About one of them, so that nearly equal large numbers keep their differences.
  const double origin = count > 0 ? numbers[ranking.order[count / 2]] : 0;
  for (const std::uint32_t i : ranking.order) mean += (numbers[i] - origin) / static_cast<double>(count);
  mean += origin;
  for (const std::uint32_t i : ranking.order) items[i] = {numbers[i], ranks[i]};
}

Sensitivity sensitivity_of(const Ranking& x, const RankedNumbers& y) {
  const double middle = 0.5 * (static_cast<double>(y.count) + 1);
  std::vector<double> sorted;
  sorted.reserve(y.count);
  // Sums over pairs of ranks minus their mean; equal x are summed together at their mean rank.
  double xx = 0, yy = 0, xy = 0;
  double tied = 0, tied_rank = 0;  // how many with the same x so far, and the sum of their y's ranks
  const auto end_tie = [&] {
    const double rank = static_cast<double>(sorted.size()) - 0.5 * (tied - 1) - middle;
    xx += tied * rank * rank;
    xy += rank * tied_rank;
    tied = tied_rank = 0;
  };
  for (std::size_t j = 0; j < x.order.size(); ++j) {
    if (!x.same[j]) end_tie();
    const RankedNumbers::Item& item = y.items[x.order[j]];
    if (std::isnan(item.rank)) continue;
    sorted.push_back(item.number - y.mean);
    const double rank = item.rank - middle;
    yy += rank * rank;
    tied += 1;
    tied_rank += rank;
  }
  end_tie();
  if (sorted.size() < kFewest || !(xx > 0) || !(yy > 0)) return {NAN, NAN, NAN};
  Sensitivity s;
  s.rank_correlation = std::clamp(xy / std::sqrt(xx * yy), -1.0, 1.0);
  first_order_of(sorted, s);
  return s;
}

namespace {

constexpr double kDependent = 1e-7;  // relative remainder below which a term depends on the previous terms

double product(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Minus their mean; equal numbers become zero.
void center(std::vector<double>& numbers) {
  if (numbers.empty()) return;
  const double origin = numbers.front();
  for (double& x : numbers) x -= origin;
  double mean = 0;
  for (const double x : numbers) mean += x / static_cast<double>(numbers.size());
  for (double& x : numbers) x -= mean;
}

// About their mean, in units of their standard deviation; missing values remain missing.
std::vector<double> scaled(std::vector<double> numbers) {
  double count = 0, mean = 0, squares = 0;
  for (const double x : numbers)
    if (std::isfinite(x)) count += 1, mean += (x - mean) / count;
  for (const double x : numbers)
    if (std::isfinite(x)) squares += (x - mean) * (x - mean);
  const double deviation = std::sqrt(squares / std::max(count, 1.0));
  for (double& x : numbers) x = std::isfinite(x) ? (deviation > 0 ? (x - mean) / deviation : 0) : NAN;
  return numbers;
}

}  // namespace

GroupSensitivity::GroupSensitivity(const std::vector<std::vector<double>>& inputs) {
  const std::size_t d = inputs.size();
  for (const std::vector<double>& input : inputs) terms_.push_back(scaled(input));
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = i; j < (d > kMostCrossed ? i + 1 : d); ++j) {
      std::vector<double> term(terms_[i].size());
      for (std::size_t row = 0; row < term.size(); ++row) term[row] = terms_[i][row] * terms_[j][row];
      terms_.push_back(std::move(term));
    }
  }
}

// An orthonormal basis of the terms in these rows: Gram-Schmidt, twice, so that it is orthogonal to rounding.
void GroupSensitivity::fit_rows(const std::vector<std::uint8_t>& used) {
  used_ = used;
  basis_.clear();
  for (const std::vector<double>& term : terms_) {
    std::vector<double> q;
    for (std::size_t row = 0; row < term.size(); ++row)
      if (used[row]) q.push_back(term[row]);
    center(q);
    const double before = std::sqrt(product(q, q));
    for (int pass = 0; pass < 2; ++pass) {
      for (const std::vector<double>& other : basis_) {
        const double part = product(other, q);
        for (std::size_t i = 0; i < q.size(); ++i) q[i] -= part * other[i];
      }
    }
    const double left = std::sqrt(product(q, q));
    if (!(left > kDependent * before) || !(left > 0)) continue;
    for (double& x : q) x /= left;
    basis_.push_back(std::move(q));
  }
}

Sensitivity GroupSensitivity::of(std::span<const double> y) {
  std::vector<std::uint8_t> used(y.size());
  std::vector<double> numbers;
  for (std::size_t row = 0; row < y.size(); ++row) {
    used[row] =
        std::isfinite(y[row]) && std::all_of(terms_.begin(), terms_.end(),
                                             [&](const std::vector<double>& term) { return std::isfinite(term[row]); });
    if (used[row]) numbers.push_back(y[row]);
  }
  const double n = static_cast<double>(numbers.size());
  if (numbers.size() < 10 + 2 * terms_.size()) return {NAN, NAN, NAN};
  center(numbers);
  const double all = product(numbers, numbers);
  if (!(all > 0)) return {NAN, NAN, NAN};
  if (used != used_) fit_rows(used);
  const double p = static_cast<double>(basis_.size());
  double explained = 0;
  for (const std::vector<double>& q : basis_) {
    const double part = product(q, numbers);
    explained += part * part / all;
  }
  Sensitivity s{1 - (1 - std::min(explained, 1.0)) * (n - 1) / (n - 1 - p), 0, NAN};
  const double share = std::clamp(s.first_order, 0.0, 1.0), rest = 1 - share;
  s.error = std::sqrt(4 * share * rest * rest / n + 2 * p / (n * n));
  return s;
}

}  // namespace grapnel
