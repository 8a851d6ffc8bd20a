#include "grapnel/campaign/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "campaign/plain_statistics.hpp"
#include "grapnel/campaign/sample_points.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace sensitivity_test {

using test::rank_correlation;
using test::sensitivity_of;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Function = std::function<double(const std::vector<double>&)>;  // on the unit cube

struct Sample {
  std::vector<std::vector<double>> x;  // per input
  std::vector<double> y;
};

Sample sample_of(const Function& function, std::size_t inputs, std::size_t n, Sampling sampling, std::uint64_t seed) {
  Sample sample{std::vector<std::vector<double>>(inputs, std::vector<double>(n)), std::vector<double>(n)};
  const SamplePoints points(sampling, inputs, n, seed);
  std::vector<double> point(inputs);
  for (std::size_t k = 0; k < n; ++k) {
    points.at(k, point);
    for (std::size_t i = 0; i < inputs; ++i) sample.x[i][k] = point[i];
    sample.y[k] = function(point);
  }
  return sample;
}

// Ishigami and Homma (1990): sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1 on -pi ... pi.
double ishigami(const std::vector<double>& u) {
  const auto x = [&](std::size_t i) { return std::numbers::pi * (2 * u[i] - 1); };
  return std::sin(x(0)) + 7 * std::pow(std::sin(x(1)), 2) + 0.1 * std::pow(x(2), 4) * std::sin(x(0));
}
const std::vector<double> kIshigami{0.3139, 0.4424, 0};

double linear(const std::vector<double>& u) { return 4 * u[0] - 2 * u[1] + u[2] + 100; }
const std::vector<double> kLinear{16.0 / 21, 4.0 / 21, 1.0 / 21};

// Sobol's g function with a = 0, 1, 4.5, 9 (Saltelli and Sobol 1995).
constexpr double kG[] = {0, 1, 4.5, 9};
double g_function(const std::vector<double>& u) {
  double product = 1;
  for (std::size_t i = 0; i < 4; ++i) product *= (std::abs(4 * u[i] - 2) + kG[i]) / (1 + kG[i]);
  return product;
}
std::vector<double> g_indices() {
  double total = 1;
  std::vector<double> parts;
  for (const double a : kG) {
    parts.push_back(1 / (3 * (1 + a) * (1 + a)));
    total *= 1 + parts.back();
  }
  for (double& part : parts) part /= total - 1;
  return parts;
}

void expect_indices(const Function& function, const std::vector<double>& exact, double tolerance) {
  for (const Sampling sampling : {Sampling::random, Sampling::latin_hypercube, Sampling::sobol}) {
    const Sample sample = sample_of(function, exact.size(), 1 << 15, sampling, 3);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      const Sensitivity s = sensitivity_of(sample.x[i], sample.y);
      EXPECT_NEAR(s.first_order, exact[i], tolerance) << name_of(sampling) << " input " << i << " error " << s.error;
      EXPECT_NEAR(s.first_order, exact[i], 4 * s.error + 0.002) << name_of(sampling) << " input " << i;
      EXPECT_LT(s.error, 0.01);
    }
  }
}

// Maximum measured deviations: 0.0066, 0.0039, 0.0047. Single neighbours (groups of one) give errors up to 0.5 on
// Sobol's sequence, whose consecutive points lie in different halves of other inputs, and up to 0.008 on the others.
TEST(Sensitivity, OfIshigamisFunction) { expect_indices(ishigami, kIshigami, 0.012); }
TEST(Sensitivity, OfALinearFunction) { expect_indices(linear, kLinear, 0.012); }
TEST(Sensitivity, OfSobolsFunction) { expect_indices(g_function, g_indices(), 0.015); }

TEST(Sensitivity, OfSmallSamples) {
  for (const std::size_t n : {std::size_t{200}, std::size_t{1000}}) {
    double worst = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Sample sample = sample_of(linear, 3, n, Sampling::random, seed);
      for (std::size_t i = 0; i < 3; ++i)
        worst = std::max(worst, std::abs(sensitivity_of(sample.x[i], sample.y).first_order - kLinear[i]));
    }
    EXPECT_LT(worst, 3 / std::sqrt(static_cast<double>(n)));  // measured 0.13 and 0.055
  }
}

// The stated error equals or slightly exceeds the standard deviation of the estimate over samples.
TEST(Sensitivity, ErrorIsTheSpreadOfTheEstimate) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<double> exact = g_indices();
  for (const std::size_t input : {std::size_t{0}, std::size_t{1}, std::size_t{3}}) {
    double sum = 0, squares = 0, errors = 0;
    constexpr int kSamples = 200;
    for (int i = 0; i < kSamples; ++i) {
      const Sample sample = sample_of(g_function, 4, 1000, Sampling::random, static_cast<std::uint64_t>(i));
      const Sensitivity s = sensitivity_of(sample.x[input], sample.y);
      sum += s.first_order;
      squares += s.first_order * s.first_order;
      errors += s.error;
    }
    const double mean = sum / kSamples, spread = std::sqrt(squares / kSamples - mean * mean);
    const double ratio = errors / kSamples / spread;
    EXPECT_NEAR(mean, exact[input], 0.01) << input;  // measured 0.0032
    EXPECT_GT(ratio, 0.8) << input;                  // measured 0.95, 1.14, 1.38
    EXPECT_LT(ratio, 1.8) << input;
  }
}

TEST(Sensitivity, OfYesAndNo) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> x(10000), decides(10000), both(10000);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = uniform(random);
    decides[i] = x[i] < 0.3;
    both[i] = (x[i] < 0.5) != (uniform(random) < 0.5);  // depends on x only in combination with another number
  }
  EXPECT_NEAR(sensitivity_of(x, decides).first_order, 1, 0.01);
  EXPECT_NEAR(sensitivity_of(x, both).first_order, 0, 0.01);
  EXPECT_NEAR(sensitivity_of(x, decides).rank_correlation, -std::sqrt(3 * 0.3 * 0.7), 0.02);
}

// An input with three values, in row order: Var(E[y|x]) is the variance of three means.
TEST(Sensitivity, OfAnInputWithFewValues) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  std::vector<double> x(9000), y(9000);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = static_cast<double>(i % 3);
    y[i] = x[i] + normal(random);
  }
  EXPECT_NEAR(sensitivity_of(x, y).first_order, (2.0 / 3) / (2.0 / 3 + 1), 0.03);
}

TEST(Sensitivity, DoesNotDependOnTheRequest) {
  Sample sample = sample_of(ishigami, 3, 3000, Sampling::random, 9);
  for (std::size_t k = 0; k < 3000; k += 7) sample.y[k] = kNaN;
  for (double& x : sample.x[0]) x = std::round(20 * x);  // ties
  const RankedNumbers ranked(sample.y);
  for (std::size_t i = 0; i < 3; ++i) {
    const Sensitivity fast = grapnel::sensitivity_of(ranking_of(sample.x[i]), ranked);
    EXPECT_NEAR(fast.rank_correlation, rank_correlation(sample.x[i], sample.y), 1e-12);
    EXPECT_NEAR(fast.first_order, sensitivity_of(sample.x[i], sample.y).first_order, 0.02);
  }
}

TEST(Sensitivity, DoesNotDependOnScaleOrOrigin) {
  const Sample sample = sample_of(linear, 3, 1000, Sampling::random, 4);
  std::vector<double> moved = sample.y;
  for (double& y : moved) y = 1e6 + 1e-3 * y;
  const Sensitivity a = sensitivity_of(sample.x[0], sample.y), b = sensitivity_of(sample.x[0], moved);
  EXPECT_NEAR(a.first_order, b.first_order, 1e-5);
  EXPECT_NEAR(a.error, b.error, 1e-5);
  EXPECT_EQ(a.rank_correlation, b.rank_correlation);
}

// A sum over groups has known shares: here 1/2, 1/3 and 1/6 by the variances.
TEST(GroupSensitivity, OfSumsAndProducts) {
  for (const Sampling sampling : {Sampling::random, Sampling::sobol}) {
    const Function f = [](const std::vector<double>& u) {
      const auto x = [&](std::size_t i) { return std::sqrt(12.0) * (u[i] - 0.5); };  // of variance 1
      return std::sqrt(3.0) * x(0) * x(1) + std::sqrt(2.0) * (x(2) + x(3)) / std::sqrt(2.0) + x(4);
    };
    const Sample sample = sample_of(f, 5, 4000, sampling, 2);
    const auto of = [&](const std::vector<std::size_t>& group) {
      std::vector<std::vector<double>> inputs;
      for (const std::size_t i : group) inputs.push_back(sample.x[i]);
      return GroupSensitivity(inputs).of(sample.y);
    };
    EXPECT_NEAR(of({0, 1}).first_order, 3.0 / 6, 0.03) << name_of(sampling);  // measured 0.011
    EXPECT_NEAR(of({2, 3}).first_order, 2.0 / 6, 0.03) << name_of(sampling);
    EXPECT_NEAR(of({2, 3, 4}).first_order, 3.0 / 6, 0.03) << name_of(sampling);
    EXPECT_NEAR(of({0, 1, 2, 3, 4}).first_order, 1, 1e-9) << name_of(sampling);
    EXPECT_NEAR(sensitivity_of(sample.x[0], sample.y).first_order, 0, 0.03) << "alone it tells nothing";
    EXPECT_LT(of({0, 1}).error, 0.02);
    EXPECT_TRUE(std::isnan(of({0, 1}).rank_correlation));
  }
}

TEST(GroupSensitivity, ChanceExplainsNothing) {
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const Sample sample = sample_of([](const std::vector<double>& u) { return u[6]; }, 7, 200, Sampling::random, seed);
    sum += GroupSensitivity({sample.x[0], sample.x[1], sample.x[2], sample.x[3], sample.x[4], sample.x[5]})
               .of(sample.y)
               .first_order;
  }
  EXPECT_NEAR(sum / 30, 0, 0.03);  // measured below 0.01; without the adjustment 27 terms of 200 rows explain 0.14
}

TEST(GroupSensitivity, OfInputsThatFollowFromEachOther) {
  Sample sample = sample_of(linear, 3, 500, Sampling::random, 1);
  std::vector<double> twice = sample.x[0], constant(500, 3.0);
  for (double& x : twice) x *= 2;
  const double alone = GroupSensitivity({sample.x[0], sample.x[1]}).of(sample.y).first_order;
  EXPECT_NEAR(GroupSensitivity({sample.x[0], twice, constant, sample.x[1]}).of(sample.y).first_order, alone, 1e-9);
  for (std::size_t i = 0; i < 500; i += 3) sample.y[i] = kNaN;
  EXPECT_NEAR(GroupSensitivity({sample.x[0], sample.x[1]}).of(sample.y).first_order, 20.0 / 21, 0.02);
  const std::vector<double> few{1, 2, 3, 4, 5, 6};
  EXPECT_TRUE(std::isnan(GroupSensitivity({few, few}).of(few).first_order));
  EXPECT_TRUE(std::isnan(GroupSensitivity({sample.x[0], sample.x[1]}).of(constant).first_order));
}

TEST(Sensitivity, IsNothingWithoutVariation) {
  const std::vector<double> x{1, 2, 3, 4, 5}, same(5, 2.0);
  EXPECT_TRUE(std::isnan(sensitivity_of(x, same).first_order));
  EXPECT_TRUE(std::isnan(sensitivity_of(same, x).first_order));
  EXPECT_TRUE(std::isnan(sensitivity_of(same, x).rank_correlation));
  EXPECT_TRUE(std::isnan(sensitivity_of(std::vector<double>{1, 2, 3}, std::vector<double>{1, 2, 3}).first_order));
  EXPECT_TRUE(std::isnan(sensitivity_of({}, {}).error));
}

TEST(RankCorrelation, IsAsPublished) {
  // Intelligence quotient and hours of television: -29/165.
  const std::vector<double> iq{106, 100, 86, 101, 99, 103, 97, 113, 112, 110},
      hours{7, 27, 2, 50, 28, 29, 20, 12, 6, 17};
  EXPECT_NEAR(sensitivity_of(iq, hours).rank_correlation, -29.0 / 165, 1e-14);
}

TEST(RankCorrelation, KnowsTiesGapsAndConstants) {
  const auto of = [](const std::vector<double>& x, const std::vector<double>& y) {
    return sensitivity_of(x, y).rank_correlation;
  };
  EXPECT_NEAR(of({1, 2, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(4.5 * 5), 1e-14);
  EXPECT_NEAR(of({1, 9, 2, 3, 4}, {1, kNaN, 4, 8, 9}), 1, 1e-14);
  EXPECT_NEAR(of({1, 2, 3, 4}, {1e300, 1e200, 1, 0}), -1, 1e-14);
  EXPECT_TRUE(std::isnan(of({1, 2, 3, 4}, {5, 5, 5, 5})));
}

// For normal variables with correlation r, Spearman's coefficient is 6/pi asin(r/2) (Pearson 1907).
TEST(RankCorrelation, FollowsTheNormalDistribution) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  constexpr double kCorrelation = 0.6;
  std::vector<double> x(50000), y(50000);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = normal(random);
    y[i] = kCorrelation * x[i] + std::sqrt(1 - kCorrelation * kCorrelation) * normal(random);
  }
  // measured 0.004
  EXPECT_NEAR(sensitivity_of(x, y).rank_correlation, 6 / std::acos(-1.0) * std::asin(kCorrelation / 2), 0.012);
}

}  // namespace sensitivity_test
}  // namespace grapnel
