// Interpolation of a run, the offset between the clocks, and verdicts, on logs made from a known motion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "grapnel/compare/align_log.hpp"
#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/run_curve.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace alignment_test {

constexpr double kJump = 12.34;  // an impact

// Rates of a tumbling body that is captured at kJump.
std::vector<double> motion(double t, double scale = 1) {
  const double before = t < kJump ? 1 : 0.4;
  return {scale * before * 0.1 * std::sin(0.7 * t), before * 0.08 * std::cos(0.45 * t + 1), 0.02 * std::sin(1.9 * t)};
}

RunCurve simulated(double interval, double end = 30, double scale = 1) {
  std::vector<double> time, values;
  const auto add = [&](double t, double at) {
    time.push_back(at);
    for (const double x : motion(t, scale)) values.push_back(x);
  };
  bool is_before = true;
  for (int k = 0; k * interval <= end; ++k) {
    const double t = k * interval;
    if (is_before && t > kJump) {
      add(std::nextafter(kJump, 0.0), kJump), add(kJump, kJump);
      is_before = false;
    }
    add(t, t);
  }
  return {std::move(time), std::move(values), 3};
}

struct Defects {
  double delay = 0, noise = 0, bias = 0;
  bool dropouts = false;
};

// A log at 50 Hz whose clock is `offset` behind that of the run; its sensor is late by a delay.
ComparedQuantity measured(double offset, const Defects& defects, unsigned seed, RunCurve curve = simulated(0.02)) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  ComparedQuantity quantity{.name = "rate",
                            .run = "base/angular_velocity",
                            .unit = "rad/s",
                            .components = {"x", "y", "z"},
                            .columns = {"gyro"},
                            .time = {},
                            .measured = {},
                            .curve = std::move(curve),
                            .is_orientation = false,
                            .uncertainty = {},
                            .bias_uncertainty = {},
                            .aligns = true};
  for (int i = 0; i < 1450; ++i) {
    const double t = 0.5 + 0.02 * i;  // of the run
    const bool is_lost = defects.dropouts && i % 500 > 440;
    quantity.time.push_back(t - offset);
    for (const double x : motion(t - defects.delay))
      quantity.measured.push_back(is_lost ? NAN : x + defects.bias + defects.noise * normal(random));
  }
  return quantity;
}

ClockOffset offset_of(const ComparedQuantity& quantity) {
  const ComparedQuantity* one = &quantity;
  const std::span<const ComparedQuantity* const> all(&one, 1);
  return find_offset(all, possible_offsets(all));
}

ComparisonReport::Quantity evaluated(const ComparedQuantity& quantity, double offset) {
  LogComparison comparison;
  comparison.report.clock.offset = offset;
  evaluate_residuals({&quantity, 1}, {}, comparison);
  return comparison.report.quantities.at(0);
}

TEST(RunCurve, InterpolatesWithOrderThreeOrMoreAndPreservesJumps) {
  std::vector<double> errors, estimates;
  for (const double interval : {0.2, 0.1, 0.05}) {
    const RunCurve curve = simulated(interval);
    double worst = 0;
    std::vector<double> x(3);
    for (double t = 2; t < 28; t += 0.0173) {
      if (std::abs(t - kJump) < 2 * interval) continue;  // one-sided slopes
      curve.value(t, x);
      for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x[c] - motion(t)[c]));
    }
    errors.push_back(worst);
    const std::vector<double> estimate = curve.interpolation_error();
    estimates.push_back(*std::ranges::max_element(estimate));
  }
  EXPECT_GT(errors[0] / errors[1], 7);  // order 4: 16
  EXPECT_GT(errors[1] / errors[2], 7);
  EXPECT_LT(errors[2], 1e-6);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GT(estimates[k], 0.2 * errors[k]);  // root mean square of the largest error
    EXPECT_LT(estimates[k], 20 * errors[k]);   // it includes the parts beside the jump
  }
  const RunCurve curve = simulated(0.1);
  std::vector<double> before(3), after(3);
  curve.value(kJump - 1e-9, before), curve.value(kJump, after);
  EXPECT_NEAR(before[0] * 0.4, after[0], 1e-6);
  EXPECT_THAT(curve.jumps(), testing::ElementsAre(kJump));
  curve.value(30.01, after);
  EXPECT_TRUE(std::isnan(after[0]));
}

TEST(RunCurve, AveragesExactly) {
  // A parabola, which cubics reproduce; its mean over [t - w, t].
  std::vector<double> time, values;
  for (int k = 0; k <= 20; ++k) time.push_back(0.1 * k), values.push_back(3 + 0.01 * k * k);
  const double w = 0.37;
  const RunCurve curve = RunCurve(time, values, 1).averaged(w);
  std::vector<double> x(1), slope(1);
  for (const double t : {0.4, 0.77, 1.3, 2.0}) {
    curve.value(t, x), curve.slope(t, slope);
    EXPECT_NEAR(x[0], 3 + t * t - t * w + w * w / 3, 1e-12);
    EXPECT_NEAR(slope[0], 2 * t - w, 1e-10);
  }
  curve.value(0.36, x);
  EXPECT_TRUE(std::isnan(x[0]));
}

TEST(Alignment, FindsTheOffsetOfNoisyLogsToATenthOfAMillisecond) {
  for (const double offset : {0.0, 3.71234, -1.7e9}) {
    const ComparedQuantity quantity = measured(offset, {.noise = 2e-5, .bias = 1e-3, .dropouts = true}, 7);
    const ClockOffset found = offset_of(quantity);
    EXPECT_TRUE(found.is_determined) << found.why_not;
    EXPECT_NEAR(found.offset, offset, 1e-4) << offset;
    EXPECT_LT(found.uncertainty, 5e-5);
    EXPECT_GT(found.uncertainty, 1e-6);
    EXPECT_FALSE(found.other);
  }
}

// The same log with a clock whose offset at its first sample is `offset`, and which then drifts.
ComparedQuantity drifting(double offset, double drift, unsigned seed, std::size_t samples = 1450) {
  ComparedQuantity quantity = measured(0, {.noise = 2e-5, .bias = 1e-3}, seed);
  const double first = quantity.time[0];
  for (double& t : quantity.time) t = first - offset + (t - first) / (1 + drift);
  quantity.time.resize(samples), quantity.measured.resize(3 * samples);
  return quantity;
}

ClockOffset drift_of(const ComparedQuantity& quantity, double largest = 5e-4) {
  const ComparedQuantity* one = &quantity;
  const std::span<const ComparedQuantity* const> all(&one, 1);
  return find_offset(all, possible_offsets(all), {0, quantity.time[0], largest});
}

TEST(Alignment, FindsOffsetAndDriftWithTheirUncertainties) {
  SKIP_UNDER_SANITIZERS();
  double squares = 0, drift_squares = 0;
  int count = 0;
  for (const double drift : {5e-5, -2e-4, 0.0}) {
    for (const double offset : {3.71234, -1.7e9, -0.5, 12.0}) {
      const ComparedQuantity quantity = drifting(offset, drift, static_cast<unsigned>(17 + count));
      const ClockOffset found = drift_of(quantity);
      EXPECT_TRUE(found.is_determined) << found.why_not;
      EXPECT_NEAR(found.offset, offset, 1e-4) << offset;
      EXPECT_NEAR(found.drift, drift, 5e-6);
      EXPECT_LT(found.drift_uncertainty, 3e-6);
      squares += std::pow((found.offset - offset) / found.uncertainty, 2);
      drift_squares += std::pow((found.drift - drift) / found.drift_uncertainty, 2);
      ++count;
    }
  }
  // Chi-square of 12 draws: 2.2 to 33 with a probability of 0.998.
  EXPECT_LT(squares, 33);
  EXPECT_GT(squares, 2.2);
  EXPECT_LT(drift_squares, 33);
  EXPECT_GT(drift_squares, 2.2);
  // Without the drift the offset is wrong by half of its effect.
  EXPECT_GT(std::abs(offset_of(drifting(0.25, -2e-4, 3)).offset - 0.25), 1e-3);
}

TEST(Alignment, FindsLargeDrifts) {
  SKIP_UNDER_SANITIZERS();
  const ClockOffset found = drift_of(drifting(2, 0.03, 5), 0.05);
  EXPECT_TRUE(found.is_determined) << found.why_not;
  EXPECT_NEAR(found.drift, 0.03, 5e-6);
  EXPECT_NEAR(found.offset, 2, 1e-4);
}

// Samples in the last part of a log move the time to which the search refers.
TEST(Alignment, OneMinimumIsNotAnotherOffset) {
  SKIP_UNDER_SANITIZERS();
  ComparedQuantity quantity = drifting(2, -0.02, 5);
  std::fill(quantity.measured.begin(), quantity.measured.begin() + 3 * 900, std::nan(""));
  const ClockOffset found = drift_of(quantity, 0.05);
  EXPECT_TRUE(found.is_determined) << found.why_not;
  EXPECT_NEAR(found.drift, -0.02, 1e-3);  // measured below 1e-4
  EXPECT_FALSE(found.other) << *found.other << " instead of " << found.offset;
}

TEST(Alignment, DoesNotInventADrift) {
  const ClockOffset of_short = drift_of(drifting(0.25, 5e-5, 3, 25));
  EXPECT_FALSE(of_short.is_determined);
  EXPECT_THAT(of_short.why_not, testing::HasSubstr("the drift is not determined: its standard uncertainty of"));
  const ClockOffset of_fast = drift_of(drifting(0.25, 1e-3, 3));
  EXPECT_FALSE(of_fast.is_determined);
  EXPECT_THAT(of_fast.why_not, testing::HasSubstr("the best drift is at an end of the searched range, 500 ppm"));
}

TEST(Alignment, ComparesSamplesOfOneTimeWithTheirCounterparts) {
  ComparedQuantity quantity = measured(0, {}, 1);
  quantity.curve = RunCurve({0, 1, 1, 1, 2}, {0, 1, 5, 7, 9}, 1);
  quantity.time = {0, 1, 1, 1, 2}, quantity.measured = {0, 1, 5, 7, 9};
  double residual = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    residual_of(quantity, i, quantity.time[i], {&residual, 1});
    EXPECT_EQ(residual, 0) << i;
  }
  quantity.time = {0, 0.5, 1, 1, 2};  // another number of samples: the value after the jump
  residual_of(quantity, 2, 1, {&residual, 1});
  EXPECT_EQ(residual, 5 - 7);
}

TEST(Alignment, IgnoresOutliers) {
  ComparedQuantity quantity = measured(0.25, {.noise = 2e-5}, 3);
  for (std::size_t i = 10; i < quantity.measured.size(); i += 450) quantity.measured[i] += 5;
  EXPECT_NEAR(offset_of(quantity).offset, 0.25, 1e-4);
}

TEST(Alignment, ReportsWhatIsNotDetermined) {
  std::vector<double> time, ramp;
  for (int k = 0; k <= 100; ++k) time.push_back(k), ramp.push_back(0.5 * k);
  ComparedQuantity quantity = measured(0, {}, 1);
  quantity.curve = RunCurve(time, ramp, 1);
  quantity.components = {"x"};
  quantity.time = time, quantity.measured = ramp;
  const ClockOffset found = offset_of(quantity);
  EXPECT_FALSE(found.is_determined);
  EXPECT_THAT(found.why_not, testing::HasSubstr("constant rate"));
}

TEST(Alignment, NamesAnotherOffsetOfPeriodicMotion) {
  std::vector<double> time, wave;
  for (int k = 0; k <= 4000; ++k) time.push_back(0.01 * k), wave.push_back(std::sin(2 * M_PI * time.back() / 5));
  ComparedQuantity quantity = measured(0, {}, 1);
  quantity.curve = RunCurve(time, wave, 1);
  quantity.components = {"x"}, quantity.uncertainty = 0.01;
  quantity.time.assign(time.begin() + 1000, time.begin() + 3000);
  quantity.measured.assign(wave.begin() + 1000, wave.begin() + 3000);
  const ClockOffset found = offset_of(quantity);
  ASSERT_TRUE(found.other);
  EXPECT_NEAR(std::remainder(*found.other - found.offset, 5.0), 0, 5e-3);
}

TEST(Verdict, AcceptsTheRightModelAndRejectsWrongOnes) {
  ComparedQuantity right = measured(0, {.noise = 2e-4}, 11);
  right.uncertainty = 2e-4, right.bias_uncertainty = 0;
  const auto report = evaluated(right, 0);
  EXPECT_EQ(report.verdict, Verdict::yes) << report.reason;
  EXPECT_NEAR(*report.chi_square, 1, 0.12);  // 4350 numbers: standard deviation 0.021
  EXPECT_NEAR(report.autocorrelation, 0, 0.08);
  EXPECT_NEAR(report.lag.value(), 0, 1e-3);
  EXPECT_EQ(report.outliers, 0u);

  // A rate that is 2 % too large, a bias, a late sensor, an uncertainty that is stated too small.
  ComparedQuantity wrong = measured(0, {.noise = 2e-4}, 11, simulated(0.02, 30, 1.02));
  wrong.uncertainty = 2e-4;
  const auto of_wrong = evaluated(wrong, 0);
  EXPECT_EQ(of_wrong.verdict, Verdict::no);
  EXPECT_GT(*of_wrong.chi_square, 3);
  ComparedQuantity biased = measured(0, {.noise = 2e-4, .bias = 6e-5}, 11);
  biased.uncertainty = 2e-4;
  EXPECT_EQ(evaluated(biased, 0).verdict, Verdict::yes);  // within the scatter: only a test of the bias detects it
  biased.bias_uncertainty = 0;
  EXPECT_EQ(evaluated(biased, 0).verdict, Verdict::no);
  biased.bias_uncertainty = 1e-4;
  EXPECT_EQ(evaluated(biased, 0).verdict, Verdict::yes);
  ComparedQuantity late = measured(0, {.delay = 0.05, .noise = 2e-4}, 11);
  late.uncertainty = 2e-4;
  const auto of_late = evaluated(late, 0);
  EXPECT_EQ(of_late.verdict, Verdict::no);
  EXPECT_NEAR(of_late.lag.value(), 0.05, 2e-3);
  ComparedQuantity noisy = measured(0, {.noise = 3e-4}, 11);
  noisy.uncertainty = 2e-4;
  EXPECT_EQ(evaluated(noisy, 0).verdict, Verdict::no);
  noisy.uncertainty.reset();
  EXPECT_EQ(evaluated(noisy, 0).verdict, Verdict::not_checked);
}

TEST(Verdict, CurvesBreakAtGaps) {
  ComparedQuantity quantity = measured(0, {.noise = 2e-4, .dropouts = true}, 5);
  LogComparison comparison;
  evaluate_residuals({&quantity, 1}, {}, comparison);
  ASSERT_EQ(comparison.curves.size(), 3u);
  const ComparedCurve& curve = comparison.curves[1];
  ASSERT_EQ(curve.after_gaps.size(), 2u);
  for (const std::size_t i : curve.after_gaps) EXPECT_NEAR(curve.time[i] - curve.time[i - 1], 1.2, 1e-9);
}

TEST(Verdict, ReportsGapsDropoutsAndSpikes) {
  ComparedQuantity quantity = measured(0, {.noise = 2e-4, .dropouts = true}, 5);
  quantity.uncertainty = 2e-4;
  for (const std::size_t i : {200u, 900u, 901u}) quantity.measured[3 * i + 1] += 0.05;
  const auto report = evaluated(quantity, 0);
  EXPECT_EQ(report.outliers, 3u);
  EXPECT_NEAR(*report.outlier_time, 4.5, 1e-9);
  EXPECT_EQ(report.missing, 59u + 59 + 9);
  EXPECT_EQ(report.gaps, 2u);
  EXPECT_NEAR(*report.longest_gap, 1.2, 1e-9);
  EXPECT_EQ(report.verdict, Verdict::yes) << report.reason;
  // Spikes beside a jump of the run are residuals of the model, and so are many.
  ComparedQuantity shifted = measured(0, {.noise = 2e-4}, 5);
  shifted.uncertainty = 2e-4;
  shifted.measured[3 * 592 + 1] += 0.5;  // t = 12.34
  EXPECT_EQ(evaluated(shifted, 0).outliers, 0u);
  EXPECT_EQ(evaluated(shifted, 0).verdict, Verdict::no);
}

}  // namespace alignment_test
}  // namespace grapnel
