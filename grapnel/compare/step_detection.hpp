#pragma once

/// @file
/// Detects instants at which measured rates jump, with a stated rate of false alarms (docs/theory, section 25).

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace grapnel {

/// Samples of one measured rate with white noise; times increase.
struct RateSamples {
  std::vector<double> time, value;
  double deviation = 0;  // standard uncertainty of each sample
};

struct DetectedStep {
  double time = 0, deviation = 0;  // with its standard uncertainty [s]
  double statistic = 0;            // root of chi-square, at its maximum
  double threshold = 0;
};

/// The test at one time: straight lines over a window before and after it; the sum over all rates of (difference at
/// that time / its standard deviation)^2, which is chi-square distributed for noise on straight lines. Rates without
/// four samples on both sides take no part.
struct StepStatistic {
  double chi_square = 0;
  int rates = 0;
};
StepStatistic step_statistic(std::span<const RateSamples> rates, double time, double window);

/// The times that are tested: between the samples of the rate that has most of them.
std::vector<double> step_candidates(std::span<const RateSamples> rates);

struct StepTest {
  double window = 0;        // before and after each time [s]
  double false_alarms = 0;  // upper bound on the expected number of false alarms in the log
  double curvature = 0;     // root of chi-square that the motion without jumps causes at most
};
/// Times at which the statistic's root exceeds sqrt(quantile) + curvature, where the quantile is that of
/// false_alarms / number of candidates: by the union bound noise exceeds it in at most `false_alarms` logs. Steps are
/// found in the order of their strength. Weaker times within a window of a step belong to it; a step's time is the mean
/// of the likelihood over the intervals between samples that do not belong to a stronger step. Sorted by time.
std::vector<DetectedStep> detect_steps(std::span<const RateSamples> rates, const StepTest& test);

/// The threshold of the root of chi-square.
double step_threshold(const StepTest& test, std::size_t candidates, int rates);

}  // namespace grapnel
