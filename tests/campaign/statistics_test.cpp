#include "grapnel/campaign/statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>

#include "campaign/plain_statistics.hpp"

namespace grapnel {
namespace statistics_test {

using test::describe_numbers;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<double> sorted(std::vector<double> numbers) {
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

// Newcombe (1998), Statistics in Medicine 17, table I, method 3.
TEST(Wilson, IsAsPublished) {
  const struct {
    std::uint64_t successes, trials;
    double lower, upper;
  } published[] = {{81, 263, 0.2553, 0.3662}, {15, 148, 0.0624, 0.1605}, {0, 20, 0, 0.1611}, {1, 29, 0.0061, 0.1718}};
  for (const auto& row : published) {
    const Proportion p = wilson(row.successes, row.trials);
    EXPECT_NEAR(p.lower, row.lower, 5.01e-5) << row.successes << "/" << row.trials;
    EXPECT_NEAR(p.upper, row.upper, 5.01e-5);
    EXPECT_DOUBLE_EQ(p.estimate, static_cast<double>(row.successes) / static_cast<double>(row.trials));
  }
}

TEST(Wilson, EndsAreWhereTheScoreTestDecides) {
  for (const auto& [successes, trials, confidence] : std::vector<std::tuple<std::uint64_t, std::uint64_t, double>>{
           {3, 10, 0.9}, {999, 1000, 0.99}, {500000, 1000000, 0.95}}) {
    const Proportion p = wilson(successes, trials, confidence);
    const double n = static_cast<double>(trials);
    for (const double end : {p.lower, p.upper}) {
      const double z = std::abs(p.estimate - end) / std::sqrt(end * (1 - end) / n);
      EXPECT_NEAR(std::erf(z / std::sqrt(2.0)), confidence, 1e-9);  // measured 3e-14
    }
  }
}

TEST(Wilson, HoldsAtTheEnds) {
  EXPECT_EQ(wilson(0, 5).lower, 0);
  EXPECT_EQ(wilson(5, 5).upper, 1);
  EXPECT_LT(wilson(5, 5).lower, 1);
  EXPECT_TRUE(std::isnan(wilson(0, 0).estimate));
  EXPECT_EQ(wilson(0, 0).lower, 0);
  EXPECT_EQ(wilson(0, 0).upper, 1);
  const Proportion all = wilson(1000000, 1000000);
  EXPECT_EQ(all.upper, 1);
  EXPECT_NEAR(1 - all.lower, 3.84e-6, 1e-8);
}

// Exact coverage from the binomial distribution, over the true probability: known to swing about the nominal one.
TEST(Wilson, CoversWithItsConfidence) {
  constexpr int kTrials = 50;
  double mean = 0, least = 1;
  int count = 0;
  for (double p = 0.05; p < 0.951; p += 0.01, ++count) {
    double coverage = 0;
    for (int k = 0; k <= kTrials; ++k) {
      const Proportion w = wilson(static_cast<std::uint64_t>(k), kTrials);
      if (w.lower > p || w.upper < p) continue;
      coverage += std::exp(std::lgamma(kTrials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(kTrials - k + 1.0) +
                           k * std::log(p) + (kTrials - k) * std::log(1 - p));
    }
    mean += coverage;
    least = std::min(least, coverage);
  }
  EXPECT_NEAR(mean / count, 0.95, 0.005);  // measured 0.9519
  EXPECT_GT(least, 0.91);                  // measured 0.9315
}

TEST(Numbers, AreDescribed) {
  const Description d =
      describe_numbers(std::vector<double>{4, kNaN, 1, 3, 2, kInfinity}, std::vector<double>{0.25, 0.5, 0.9});
  EXPECT_EQ(d.count, 4u);
  EXPECT_EQ(d.missing, 2u);
  EXPECT_DOUBLE_EQ(d.mean, 2.5);
  EXPECT_DOUBLE_EQ(d.standard_deviation, std::sqrt(5.0 / 3));
  EXPECT_DOUBLE_EQ(d.mean_error, std::sqrt(5.0 / 12));
  EXPECT_EQ(d.least, 1);
  EXPECT_EQ(d.largest, 4);
  EXPECT_DOUBLE_EQ(d.quantiles[0].value, 1.75);  // R: quantile(1:4, 0.25)
  EXPECT_DOUBLE_EQ(d.quantiles[1].value, 2.5);
  EXPECT_DOUBLE_EQ(d.quantiles[2].value, 3.7);
}

TEST(Numbers, MayBeFewOrTheSame) {
  const std::vector<double> half{0.5};
  const Description none = describe_numbers(std::vector<double>{kNaN}, half);
  EXPECT_EQ(none.count, 0u);
  EXPECT_TRUE(std::isnan(none.mean) && std::isnan(none.least) && std::isnan(none.quantiles[0].value));
  const Description one = describe_numbers(std::vector<double>{7}, half);
  EXPECT_EQ(one.mean, 7);
  EXPECT_TRUE(std::isnan(one.standard_deviation));
  EXPECT_EQ(one.quantiles[0].value, 7);
  EXPECT_TRUE(std::isnan(one.quantiles[0].lower));
  const Description same = describe_numbers(std::vector<double>(1000, 0.1), half);
  EXPECT_EQ(same.mean, 0.1) << "not 0.1 and a rounding error";
  EXPECT_EQ(same.standard_deviation, 0);
}

TEST(Numbers, KeepTheirDigits) {
  // Nearly equal large numbers: naive sums of squares lose all digits here.
  const Description d = describe_numbers(std::vector<double>{1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16}, {});
  EXPECT_EQ(d.mean, 1e9 + 10);
  EXPECT_DOUBLE_EQ(d.standard_deviation, std::sqrt(30.0));
  const Description large = describe_numbers(std::vector<double>{-1.7e308, 1.7e308}, std::vector<double>{0.5});
  EXPECT_EQ(large.quantiles[0].value, 0);
}

TEST(Numbers, FollowTheirDistribution) {
  std::mt19937_64 random(3);
  std::exponential_distribution<double> exponential(2);
  std::vector<double> numbers(100000);
  for (double& x : numbers) x = exponential(random);
  const Description d = describe_numbers(numbers, std::vector<double>{0.1, 0.5, 0.99});
  EXPECT_NEAR(d.mean, 0.5, 4 * d.mean_error);  // measured 0.36 errors
  EXPECT_NEAR(d.mean_error, 0.5 / std::sqrt(1e5), 2e-5);
  EXPECT_NEAR(d.standard_deviation, 0.5, 0.01);
  for (const QuantileEstimate& q : d.quantiles) {
    const double exact = -std::log(1 - q.probability) / 2;
    EXPECT_LT(q.lower, exact);
    EXPECT_GT(q.upper, exact);
    EXPECT_LT(q.upper - q.lower, 0.1 * exact);
  }
}

TEST(QuantileRanks, AreTheTablesOnes) {
  // Conover (1999), Practical Nonparametric Statistics, table A3 and section 3.2, for the median at 95 %.
  const auto expect = [](std::uint64_t n, double p, double confidence, std::int64_t lower, std::int64_t upper) {
    const QuantileRanks ranks = quantile_ranks(n, p, confidence);
    EXPECT_EQ(ranks.lower, lower) << n;
    EXPECT_EQ(ranks.upper, upper) << n;
  };
  expect(5, 0.5, 0.95, -1, 5);
  expect(6, 0.5, 0.95, 0, 5);
  expect(10, 0.5, 0.95, 1, 8);
  expect(20, 0.5, 0.95, 5, 14);
  expect(100, 0.5, 0.95, 39, 60);
  expect(0, 0.5, 0.95, -1, 0);
  expect(10, 1, 0.95, -1, 10);
  // 0.95^59 < 0.05: Wilks (1941), the 59 runs for the 95 % quantile at one-sided confidence 95 %.
  EXPECT_EQ(quantile_ranks(59, 0.95, 0.90).upper, 58);
  EXPECT_EQ(quantile_ranks(58, 0.95, 0.90).upper, 58);
}

TEST(QuantileRanks, CoverWithTheirConfidenceForManyRows) {
  constexpr double kPart = 0.01;
  const std::uint64_t n = 1000000;
  const QuantileRanks ranks = quantile_ranks(n, kPart, 0.95);
  const double deviation = std::sqrt(static_cast<double>(n) * kPart * (1 - kPart));
  EXPECT_NEAR(static_cast<double>(ranks.lower), 1e4 - 1.96 * deviation, 2);
  EXPECT_NEAR(static_cast<double>(ranks.upper), 1e4 + 1.96 * deviation, 2);
}

TEST(QuantileRanks, CoverWithTheirConfidence) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  int covered = 0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> numbers(80);
    for (double& x : numbers) x = uniform(random);
    const QuantileEstimate q = describe_numbers(numbers, std::vector<double>{0.2}).quantiles[0];
    covered += q.lower <= 0.2 && 0.2 <= q.upper;
  }
  EXPECT_GT(covered, 0.95 * kSamples);  // measured 0.9647
  EXPECT_LT(covered, 0.985 * kSamples);
}

TEST(Histogram, CountsEveryNumber) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<double> numbers(5000);
  for (double& x : numbers) x = normal(random);
  const Histogram h = histogram_of_sorted(sorted(numbers));
  EXPECT_EQ(h.below + h.above, 0u);
  EXPECT_EQ(std::accumulate(h.counts.begin(), h.counts.end(), std::uint64_t{0}), numbers.size());
  EXPECT_GE(h.counts.size(), 10u);
  EXPECT_LE(h.counts.size(), 60u);
  // The shape: as many as the normal distribution has in each bin, within five standard deviations.
  const double width = (h.end - h.begin) / static_cast<double>(h.counts.size());
  for (std::size_t i = 0; i < h.counts.size(); ++i) {
    const double from = h.begin + static_cast<double>(i) * width;
    const double expected = 2500 * (std::erf((from + width) / std::sqrt(2.0)) - std::erf(from / std::sqrt(2.0)));
    EXPECT_NEAR(static_cast<double>(h.counts[i]), expected, 5 * std::sqrt(expected) + 3);
  }
}

TEST(Histogram, LeavesFarNumbersOutside) {
  std::vector<double> numbers(1000);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i) / 1000;
  numbers.push_back(1e6);
  numbers.push_back(-1e300);
  const Histogram h = histogram_of_sorted(sorted(numbers));
  EXPECT_EQ(h.below, 1u);
  EXPECT_EQ(h.above, 1u);
  EXPECT_GT(h.begin, -0.2);
  EXPECT_LT(h.end, 1.2);
  EXPECT_EQ(std::accumulate(h.counts.begin(), h.counts.end(), std::uint64_t{0}), 1000u);
}

TEST(Histogram, HandlesConstantsWholeNumbersAndNoNumbers) {
  EXPECT_TRUE(histogram_of_sorted({}).counts.empty());
  const Histogram same = histogram_of_sorted(std::vector<double>(9, 0.3));
  EXPECT_EQ(same.counts, (std::vector<std::uint64_t>{9}));
  EXPECT_EQ(same.begin, 0.3);
  EXPECT_EQ(same.end, 0.3);
  const Histogram whole = histogram_of_sorted(std::vector<double>{0, 0, 1, 1, 1, 3});
  EXPECT_EQ(whole.begin, -0.5);
  EXPECT_EQ(whole.end, 3.5);
  EXPECT_EQ(whole.counts, (std::vector<std::uint64_t>{2, 3, 0, 1}));
  const Histogram two = histogram_of_sorted(std::vector<double>{0.1, std::nextafter(0.1, 1.0)});
  EXPECT_EQ(two.counts.front(), 1u);
  EXPECT_EQ(two.counts.back(), 1u);
  const Histogram range = histogram_of_sorted(std::vector<double>{-1.7e308, 0.5, 1.7e308});
  EXPECT_EQ(std::accumulate(range.counts.begin(), range.counts.end(), std::uint64_t{0}) + range.below + range.above,
            3u);
  // Many of one value and few others: the quartiles coincide.
  std::vector<double> mostly(1000, 0.5);
  mostly.push_back(0.75);
  const Histogram most = histogram_of_sorted(mostly);
  EXPECT_EQ(std::accumulate(most.counts.begin(), most.counts.end(), std::uint64_t{0}), 1001u);
}

TEST(Ranking, SharesRanksAmongEqualNumbers) {
  const std::vector<double> numbers{3, 1, kNaN, 3, 2};
  const Ranking ranking = ranking_of(numbers);
  ASSERT_EQ(ranking.order.size(), 4u);
  EXPECT_EQ(ranking.order[0], 1u);
  EXPECT_EQ(ranking.order[1], 4u);
  EXPECT_EQ(ranking.same, (std::vector<std::uint8_t>{0, 0, 0, 1}));
  const std::vector<double> ranks = mean_ranks(ranking, numbers.size());
  EXPECT_EQ(ranks[0], 3.5);
  EXPECT_EQ(ranks[1], 1);
  EXPECT_TRUE(std::isnan(ranks[2]));
  EXPECT_EQ(ranks[3], 3.5);
  EXPECT_EQ(ranks[4], 2);
}

// Numbers of both signs and all sizes, both zeros, infinities and many that are equal, against a sort by comparison.
TEST(Ranking, OrdersAllFiniteNumbers) {
  const double large = std::numeric_limits<double>::max(), small = std::numeric_limits<double>::denorm_min();
  std::vector<double> numbers{0.0,
                              -0.0,
                              large,
                              -large,
                              small,
                              -small,
                              1.0,
                              std::nextafter(1.0, 2.0),
                              -1.0,
                              kNaN,
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity()};
  std::uint64_t state = 1;
  for (int i = 0; i < 3000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    numbers.push_back(std::ldexp(static_cast<double>(state % 7) - 3.0, static_cast<int>(state >> 60)));
  }
  std::vector<double> expected;
  std::copy_if(numbers.begin(), numbers.end(), std::back_inserter(expected), [](double x) { return std::isfinite(x); });
  std::sort(expected.begin(), expected.end());
  const Ranking ranking = ranking_of(numbers);
  ASSERT_EQ(ranking.order.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(numbers[ranking.order[i]], expected[i]);
    EXPECT_EQ(ranking.same[i] != 0, i > 0 && expected[i] == expected[i - 1]);
  }
  EXPECT_TRUE(ranking_of({}).order.empty());
}

}  // namespace statistics_test
}  // namespace grapnel
