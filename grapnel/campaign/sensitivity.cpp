#include "grapnel/campaign/sensitivity.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
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

// `y` in the order of x, less its mean.
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
  // About one of them: large numbers that hardly differ keep their differences.
  const double origin = count > 0 ? numbers[ranking.order[count / 2]] : 0;
  for (const std::uint32_t i : ranking.order) mean += (numbers[i] - origin) / static_cast<double>(count);
  mean += origin;
  for (const std::uint32_t i : ranking.order) items[i] = {numbers[i], ranks[i]};
}

Sensitivity sensitivity_of(const Ranking& x, const RankedNumbers& y) {
  const double middle = 0.5 * (static_cast<double>(y.count) + 1);
  std::vector<double> sorted;
  sorted.reserve(y.count);
  // Sums over pairs of ranks less their mean; of equal x at once, at their mean rank.
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

constexpr double kDependent = 1e-7;  // what is left of a term that follows from those before, relative to itself

double product(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Less their mean; equal ones become zero.
void center(std::vector<double>& numbers) {
  if (numbers.empty()) return;
  const double origin = numbers.front();
  for (double& x : numbers) x -= origin;
  double mean = 0;
  for (const double x : numbers) mean += x / static_cast<double>(numbers.size());
  for (double& x : numbers) x -= mean;
}

// About their mean, in units of their standard deviation; what does not exist stays so.
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
