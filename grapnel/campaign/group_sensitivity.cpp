#include "grapnel/campaign/group_sensitivity.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
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
