#include "grapnel/compare/step_detection.hpp"
#include "grapnel/compare/chi_square.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "grapnel/compare/impulse_estimate.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kLeastSamples = 4;  // per side
constexpr double kFlankNoise = 2;         // increase of the statistic's root by noise, between times within a window

// A straight line through samples: its value at t = 0, and the variance of that for unit noise.
struct Line {
  double value, variance;
};

template <class Iterator>
Line line_at(const RateSamples& rate, Iterator begin, Iterator end, double time) {
  double n = 0, sum_s = 0, sum_y = 0;
  for (Iterator at = begin; at != end; ++at)
    n += 1, sum_s += *at - time, sum_y += rate.value[static_cast<std::size_t>(at - rate.time.begin())];
  const double mean_s = sum_s / n, mean_y = sum_y / n;
  double ss = 0, sy = 0;
  for (Iterator at = begin; at != end; ++at) {
    const double s = *at - time - mean_s;
    ss += s * s, sy += s * (rate.value[static_cast<std::size_t>(at - rate.time.begin())] - mean_y);
  }
  return {mean_y - sy / ss * mean_s, 1 / n + mean_s * mean_s / ss};
}

}  // namespace

StepStatistic step_statistic(std::span<const RateSamples> rates, double time, double window) {
  StepStatistic result;
  for (const RateSamples& rate : rates) {
    const auto first = std::lower_bound(rate.time.begin(), rate.time.end(), time - window);
    const auto middle = std::lower_bound(first, rate.time.end(), time);
    const auto last = std::upper_bound(middle, rate.time.end(), time + window);
    if (middle - first < static_cast<std::ptrdiff_t>(kLeastSamples) ||
        last - middle < static_cast<std::ptrdiff_t>(kLeastSamples))
      continue;
    const Line before = line_at(rate, first, middle, time), after = line_at(rate, middle, last, time);
    const double difference = after.value - before.value;
    const double variance = rate.deviation * rate.deviation * (before.variance + after.variance);
    if (!(variance > 0)) continue;
    result.chi_square += difference * difference / variance;
    ++result.rates;
  }
  return result;
}

std::vector<double> step_candidates(std::span<const RateSamples> rates) {
  const RateSamples* most = nullptr;
  for (const RateSamples& rate : rates) {
    if (!most || rate.time.size() > most->time.size()) most = &rate;
  }
  std::vector<double> candidates;
  for (std::size_t i = 1; most && i < most->time.size(); ++i) {
    if (most->time[i] > most->time[i - 1]) candidates.push_back(0.5 * (most->time[i - 1] + most->time[i]));
  }
  return candidates;
}

double step_threshold(const StepTest& test, std::size_t candidates, int rates) {
  const double p = std::min(test.false_alarms / static_cast<double>(std::max<std::size_t>(candidates, 1)), 0.5);
  return std::sqrt(chi_square_quantile(p, rates)) + test.curvature;
}

namespace {

// The statistic at the tested times.
struct TestedTimes {
  std::vector<double> time, root, excess;  // excess: of the root above its threshold
  std::vector<bool> is_used;               // by a step
};

TestedTimes tested_times(std::span<const RateSamples> rates, const StepTest& test) {
  TestedTimes tested;
  tested.time = step_candidates(rates);
  const std::size_t count = tested.time.size();
  tested.root.assign(count, 0.0), tested.excess.assign(count, -1.0), tested.is_used.assign(count, false);
  std::map<int, double> thresholds;  // by the number of rates
  for (std::size_t i = 0; i < count; ++i) {
    const StepStatistic s = step_statistic(rates, tested.time[i], test.window);
    if (s.rates == 0) continue;
    const auto [at, is_new] = thresholds.try_emplace(s.rates, 0.0);
    if (is_new) at->second = step_threshold(test, count, s.rates);
    tested.root[i] = std::sqrt(s.chi_square), tested.excess[i] = tested.root[i] - at->second;
  }
  return tested;
}

// The times that a jump at `best` raises: those within a window of it, and, for a jump that takes time or is not
// exactly at `best`, the flanks beyond, which fall with the distance.
std::pair<std::size_t, std::size_t> raised_by(const TestedTimes& tested, std::size_t best, double window) {
  const auto is_flank = [&](std::size_t i, double& lowest) {
    if (tested.is_used[i] || !(tested.excess[i] > 0) || tested.root[i] > lowest + kFlankNoise) return false;
    lowest = std::min(lowest, tested.root[i]);
    return true;
  };
  const auto& t = tested.time;
  std::size_t begin = best, end = best + 1;
  while (begin > 0 && t[begin - 1] >= t[best] - window) --begin;
  while (end < t.size() && t[end] <= t[best] + window) ++end;
  for (double lowest = tested.root[begin]; begin > 0 && is_flank(begin - 1, lowest);) --begin;
  for (double lowest = tested.root[end - 1]; end < t.size() && is_flank(end, lowest);) ++end;
  return {begin, end};
}

// The mean of the likelihood over the times that no stronger step raises.
DetectedStep step_at(const TestedTimes& tested, std::size_t best, double window) {
  const std::vector<double>&t = tested.time, &root = tested.root;
  double sum = 0, mean = 0, square = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    const double s = t[k] - t[best];
    if (std::abs(s) > window || tested.is_used[k] || root[k] > root[best]) continue;
    const double likelihood = std::exp(0.5 * (root[k] * root[k] - root[best] * root[best]));
    sum += likelihood, mean += likelihood * s, square += likelihood * s * s;
  }
  mean /= sum;
  double interval = window;  // between the samples around the jump
  if (best > 0) interval = std::min(interval, t[best] - t[best - 1]);
  if (best + 1 < t.size()) interval = std::min(interval, t[best + 1] - t[best]);
  const double variance = std::max(square / sum - mean * mean, 0.0) + interval * interval / 12;
  return {t[best] + mean, std::sqrt(variance), root[best], root[best] - tested.excess[best]};
}

}  // namespace

// The strongest step first: weaker ones are sought where it does not raise the statistic.
std::vector<DetectedStep> detect_steps(std::span<const RateSamples> rates, const StepTest& test) {
  TestedTimes tested = tested_times(rates, test);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < tested.time.size(); ++i) {
    if (tested.excess[i] > 0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tested.root[a] > tested.root[b]; });
  std::vector<DetectedStep> steps;
  for (const std::size_t best : order) {
    if (tested.is_used[best]) continue;
    steps.push_back(step_at(tested, best, test.window));
    const auto [begin, end] = raised_by(tested, best, test.window);
    std::fill(tested.is_used.begin() + static_cast<std::ptrdiff_t>(begin),
              tested.is_used.begin() + static_cast<std::ptrdiff_t>(end), true);
  }
  std::sort(steps.begin(), steps.end(), [](const DetectedStep& a, const DetectedStep& b) { return a.time < b.time; });
  return steps;
}

}  // namespace grapnel
