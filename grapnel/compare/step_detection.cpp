#include "grapnel/compare/step_detection.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/compare/impulse_estimate.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kLeastSamples = 4;  // per side

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

std::vector<DetectedStep> detect_steps(std::span<const RateSamples> rates, const StepTest& test) {
  const std::vector<double> times = step_candidates(rates);
  std::vector<double> root(times.size(), 0.0), excess(times.size(), -1.0);
  std::map<int, double> thresholds;  // by the number of rates
  for (std::size_t i = 0; i < times.size(); ++i) {
    const StepStatistic s = step_statistic(rates, times[i], test.window);
    if (s.rates == 0) continue;
    const auto [at, is_new] = thresholds.try_emplace(s.rates, 0.0);
    if (is_new) at->second = step_threshold(test, times.size(), s.rates);
    root[i] = std::sqrt(s.chi_square), excess[i] = root[i] - at->second;
  }
  std::vector<DetectedStep> steps;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!(excess[i] > 0)) continue;
    // One jump raises the statistic within a window of it.
    std::size_t best = i, end = i;
    for (; end < times.size() && times[end] <= times[best] + test.window; ++end) {
      if (root[end] > root[best]) best = end;
    }
    double sum = 0, mean = 0, square = 0;
    for (std::size_t k = 0; k < times.size(); ++k) {
      if (std::abs(times[k] - times[best]) > test.window) continue;
      const double likelihood = std::exp(0.5 * (root[k] * root[k] - root[best] * root[best]));
      const double s = times[k] - times[best];
      sum += likelihood, mean += likelihood * s, square += likelihood * s * s;
    }
    mean /= sum;
    double interval = test.window;  // between the samples around the jump
    if (best > 0) interval = std::min(interval, times[best] - times[best - 1]);
    if (best + 1 < times.size()) interval = std::min(interval, times[best + 1] - times[best]);
    const double variance = std::max(square / sum - mean * mean, 0.0) + interval * interval / 12;
    steps.push_back({times[best] + mean, std::sqrt(variance), root[best], root[best] - excess[best]});
    i = end > i ? end - 1 : i;
  }
  return steps;
}

}  // namespace grapnel
