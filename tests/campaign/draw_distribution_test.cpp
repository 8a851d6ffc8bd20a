#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "grapnel/campaign/sample_points.hpp"
#include "grapnel/campaign/uncertain_value.hpp"

namespace grapnel {
namespace draw_distribution_test {

using Kind = NumberDistribution::Kind;

constexpr int kDraws = 20000;

std::vector<double> draws(const NumberDistribution& d, std::uint64_t seed) {
  std::vector<double> values;
  for (int k = 0; k < kDraws; ++k) values.push_back(d.at(unit_number(seed, static_cast<std::uint64_t>(k), 0)));
  return values;
}

double mean_of(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v;
  return sum / static_cast<double>(x.size());
}
double deviation_of(const std::vector<double>& x) {
  const double mean = mean_of(x);
  double sum = 0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

// Kolmogorov and Smirnov's distance, times the square root of the number of draws: above 1.95 once in a thousand.
double kolmogorov(std::vector<double> x, const std::function<double(double)>& probability) {
  std::sort(x.begin(), x.end());
  const auto n = static_cast<double>(x.size());
  double distance = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double p = probability(x[i]), rank = static_cast<double>(i);
    distance = std::max({distance, p - rank / n, (rank + 1) / n - p});
  }
  return distance * std::sqrt(n);
}

TEST(NormalQuantile, InvertsTheProbabilityEverywhere) {
  double worst = 0;
  for (double p : {1e-300, 1e-100, 1e-20, 1e-12, 1e-6, 1e-3, 0.02, 0.0749, 0.0751, 0.3, 0.4999, 0.5}) {
    const double z = normal_quantile(p);
    // Relative to the slope: an error of z of 1 unit in the last place changes p by z^2 units.
    const double error = std::abs(normal_probability(z) - p) / p / (1 + z * z);
    worst = std::max(worst, error);
  }
  EXPECT_LT(worst, 1e-15);  // measured 2e-16
}

TEST(NormalQuantile, KnownValuesAndSymmetry) {
  EXPECT_EQ(normal_quantile(0.5), 0.0);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 2e-15);
  EXPECT_NEAR(normal_quantile(0.99), 2.3263478740408408, 4e-15);
  EXPECT_NEAR(normal_quantile(1e-10), -6.361340902404056, 8e-15);
  EXPECT_NEAR(normal_quantile(1e-20), -9.262340089798409, 2e-14);
  for (const double p : {0.25, 0.125, 0.0625, 0.03125}) EXPECT_EQ(normal_quantile(p), -normal_quantile(1 - p));
}

TEST(Distribution, NormalHasItsMomentsAndShape) {
  const NumberDistribution d{Kind::normal, 3, 0.5, 0, 0, false};
  const auto x = draws(d, 1);
  EXPECT_NEAR(mean_of(x), 3, 4 * 0.5 / std::sqrt(kDraws));
  EXPECT_NEAR(deviation_of(x), 0.5, 4 * 0.5 / std::sqrt(2.0 * kDraws));
  EXPECT_LT(kolmogorov(x, [](double v) { return normal_probability((v - 3) / 0.5); }), 1.95);
}

TEST(Distribution, CutNormalStaysInsideAndHasItsShape) {
  const double from = 2.9, to = 4;
  const NumberDistribution d{Kind::normal, 3, 0.5, from, to, true};
  const double p = normal_probability((from - 3) / 0.5), q = normal_probability((to - 3) / 0.5);
  const auto x = draws(d, 2);
  EXPECT_GE(*std::min_element(x.begin(), x.end()), from);
  EXPECT_LE(*std::max_element(x.begin(), x.end()), to);
  EXPECT_LT(kolmogorov(x, [&](double v) { return (normal_probability((v - 3) / 0.5) - p) / (q - p); }), 1.95);
}

TEST(Distribution, TruncatedNormalInATailKeepsPrecision) {
  // Beyond 9 deviations above the mean the tail is nearly exponential with slope 9 per deviation.
  const NumberDistribution d{Kind::normal, 0, 1, 9, HUGE_VAL, true};
  const double median = d.at(0.5);
  EXPECT_NEAR(normal_probability(-median) / normal_probability(-9), 0.5, 1e-12);
  EXPECT_GT(median, 9);
  EXPECT_LT(median, 9.1);
  EXPECT_EQ((NumberDistribution{Kind::normal, 0, 1, -HUGE_VAL, -9, true}.at(0.5)), -median);
}

TEST(Distribution, BoundsInDeviations) {
  const NumberDistribution normal{NumberDistribution::Kind::normal, 1, 0.01, 0.5, 3, true},
      log_normal{NumberDistribution::Kind::log_normal, 2, 0.5, 2 * std::exp(-1.0), 2 * std::exp(1.5), true},
      from_zero{NumberDistribution::Kind::log_normal, 2, 0.5, 0, 2, true};
  EXPECT_NEAR(normal.standard_bounds()[0], -50, 1e-12);     // measured 0
  EXPECT_NEAR(normal.standard_bounds()[1], 200, 1e-12);     // measured 0
  EXPECT_NEAR(log_normal.standard_bounds()[0], -2, 1e-14);  // measured 0
  EXPECT_NEAR(log_normal.standard_bounds()[1], 3, 1e-14);   // measured 0
  EXPECT_EQ(from_zero.standard_bounds()[0], -40);
  EXPECT_EQ(from_zero.standard_bounds()[1], 0);
}

TEST(Distribution, LogNormalUniformAndIntegers) {
  const NumberDistribution log_normal{Kind::log_normal, 2, 0.3, 0, 0, false};
  EXPECT_LT(kolmogorov(draws(log_normal, 3), [](double v) { return normal_probability(std::log(v / 2) / 0.3); }), 1.95);
  const NumberDistribution cut{Kind::log_normal, 2, 0.3, 1.5, 2.5, true};
  const auto inside = draws(cut, 3);
  EXPECT_GE(*std::min_element(inside.begin(), inside.end()), 1.5);
  EXPECT_LE(*std::max_element(inside.begin(), inside.end()), 2.5);
  const auto probability = [](double v) { return normal_probability(std::log(v / 2) / 0.3); };
  EXPECT_NEAR(probability(cut.at(0.5)), 0.5 * (probability(1.5) + probability(2.5)), 1e-15);

  const NumberDistribution uniform{Kind::uniform, 0, 0, -1, 3, false};
  EXPECT_LT(kolmogorov(draws(uniform, 4), [](double v) { return (v + 1) / 4; }), 1.95);

  const NumberDistribution integers{Kind::integers, 0, 0, 2, 5, false};
  std::vector<int> counts(4, 0);
  for (const double v : draws(integers, 5)) {
    ASSERT_EQ(v, std::floor(v));
    ASSERT_TRUE(v >= 2 && v <= 5);
    ++counts[static_cast<std::size_t>(v) - 2];
  }
  for (const int count : counts) EXPECT_NEAR(count, kDraws / 4, 5 * std::sqrt(kDraws * 0.1875));
  const NumberDistribution seeds{Kind::integers, 0, 0, 0, 9007199254740991, false};
  EXPECT_LE(seeds.at(unit_number(~0u, ~0u)), 9007199254740991.0);
  EXPECT_GE(seeds.at(unit_number(0u, 0u)), 0.0);
}

TEST(Distribution, DirectionsAreUniformOnTheSphere) {
  std::vector<double> x, y, z;
  for (std::uint64_t k = 0; k < kDraws; ++k) {
    const Vector3d n = random_direction(unit_number(7, k, 0), unit_number(7, k, 1));
    ASSERT_NEAR(norm(n), 1, 1e-15);
    x.push_back(n[0]), y.push_back(n[1]), z.push_back(n[2]);
  }
  // Every component is uniform in (-1, 1).
  for (const auto& component : {x, y, z}) EXPECT_LT(kolmogorov(component, [](double v) { return (v + 1) / 2; }), 1.95);
}

TEST(Distribution, RotationsAreUniform) {
  std::vector<double> angles, images;
  const Vector3d fixed{0.6, 0, 0.8};
  for (std::uint64_t k = 0; k < kDraws; ++k) {
    const Quaterniond q = random_rotation(unit_number(8, k, 0), unit_number(8, k, 1), unit_number(8, k, 2));
    ASSERT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 1e-14);
    const Rotationd R = rotation_matrix(q);
    angles.push_back(rotation_angle(R));
    images.push_back((R * fixed)[1]);
  }
  // The angle of a uniform rotation has the density (1 - cos) / pi; what it makes of a vector is uniform on the sphere.
  EXPECT_LT(kolmogorov(angles, [](double a) { return (a - std::sin(a)) / std::numbers::pi; }), 1.95);
  EXPECT_LT(kolmogorov(images, [](double v) { return (v + 1) / 2; }), 1.95);
}

TEST(Distribution, TiltKeepsTheLengthAndRotatesByTheAngle) {
  for (const Vector3d& v : {Vector3d{0, 0, 0.2}, Vector3d{1, 2, -3}, Vector3d{-4, 0, 0}}) {
    const Vector3d w = tilted(v, 0.03, -0.04);
    EXPECT_NEAR(norm(w), norm(v), 1e-15 * norm(v));
    EXPECT_NEAR(std::atan2(norm(cross(v, w)), dot(v, w)), 0.05, 1e-15);
  }
  const Vector3d zero = tilted(Vector3d::zero(), 0.1, 0.1), same = tilted({0, 0, 2}, 0, 0);
  EXPECT_EQ(norm(zero), 0);
  EXPECT_EQ(same[2], 2);
}

TEST(Distribution, RotationByAVector) {
  const Vector3d turn{0.1, -0.2, 0.3};
  const Vector3d back = rotation_vector(rotation_matrix(quaternion_by(turn)));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], turn[i], 1e-15);
  EXPECT_EQ(quaternion_by(Vector3d::zero()).w, 1);
}

TEST(Covariance, FactorsAndRefuses) {
  const std::vector<double> A{4, 2, 0.6, 2, 2, 0.5, 0.6, 0.5, 1};
  const auto L = semidefinite_factor(A, 3);
  ASSERT_TRUE(L);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += (*L)[i * 3 + k] * (*L)[j * 3 + k];
      EXPECT_NEAR(sum, A[i * 3 + j], 1e-15 * 4);
    }
  }
  // Semidefinite: the third is the sum of the others.
  const std::vector<double> B{1, 0.5, 1.5, 0.5, 1, 1.5, 1.5, 1.5, 3};
  const auto S = semidefinite_factor(B, 3);
  ASSERT_TRUE(S);
  EXPECT_NEAR((*S)[8], 0, 1e-7);
  EXPECT_TRUE(semidefinite_factor(std::vector<double>{0, 0, 0, 1}, 2));
  EXPECT_FALSE(semidefinite_factor(std::vector<double>{1, 1.1, 1.1, 1}, 2));
  EXPECT_FALSE(semidefinite_factor(std::vector<double>{0, 0.1, 0.1, 1}, 2));
  EXPECT_FALSE(semidefinite_factor(std::vector<double>{-1, 0, 0, 1}, 2));
}

TEST(Covariance, IsRecoveredFromDraws) {
  const std::vector<double> A{4, 2, 0.6, 2, 2, 0.5, 0.6, 0.5, 1};
  const UncertainValue value = CorrelatedNumbers{{1, 2, 3}, *semidefinite_factor(A, 3), ValueForm::offset};
  ASSERT_EQ(dimensions(value), 3u);
  const std::vector<double> nominal{10, 20, 30};
  std::vector<double> sum(3, 0.0), products(9, 0.0);
  for (std::uint64_t k = 0; k < kDraws; ++k) {
    const std::vector<double> u{unit_number(9, k, 0), unit_number(9, k, 1), unit_number(9, k, 2)};
    const auto x = draw_value(value, nominal, u).numbers;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = x[i] - (11 * static_cast<double>(i + 1));
      sum[i] += d;
      for (std::size_t j = 0; j < 3; ++j) products[i * 3 + j] += d * (x[j] - (11 * static_cast<double>(j + 1)));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(sum[i] / kDraws, 0, 4 * std::sqrt(A[i * 3 + i] / kDraws));
    for (std::size_t j = 0; j < 3; ++j) {
      const double error = std::sqrt((A[i * 3 + i] * A[j * 3 + j] + A[i * 3 + j] * A[i * 3 + j]) / kDraws);
      EXPECT_NEAR(products[i * 3 + j] / kDraws, A[i * 3 + j], 4 * error);
    }
  }
}

TEST(Draw, FormsAndConstants) {
  const NumberDistribution number{Kind::uniform, 0, 0, 0, 2, false}, none{Kind::constant, 1, 0, 0, 0, false};
  const std::vector<double> nominal{10, 20}, middle{0.5};
  const UncertainValue one = IndependentNumbers{{number, none}, ValueForm::factor};
  EXPECT_EQ(dimensions(one), 1u);
  EXPECT_THAT(draw_value(one, nominal, middle).numbers, ::testing::ElementsAre(10, 20));
  EXPECT_THAT(draw_value(one, nominal, middle).shown, ::testing::ElementsAre(10));
  const UncertainValue common = CommonNumber{{Kind::uniform, 0, 0, 0, 4, false}, ValueForm::offset};
  EXPECT_THAT(draw_value(common, nominal, middle).numbers, ::testing::ElementsAre(12, 22));
  EXPECT_THAT(draw_value(common, nominal, middle).shown, ::testing::ElementsAre(2));
}

TEST(Draw, DistinguishesReplacedValues) {
  EXPECT_TRUE(replaces(IndependentNumbers{{}, ValueForm::value}));
  EXPECT_FALSE(replaces(IndependentNumbers{{}, ValueForm::factor}));
  EXPECT_FALSE(replaces(CommonNumber{{}, ValueForm::offset}));
  EXPECT_FALSE(replaces(CorrelatedNumbers{{}, {}, ValueForm::offset}));
  EXPECT_TRUE(replaces(SphereVector{}));
  EXPECT_FALSE(replaces(TiltedVector{}));
  EXPECT_TRUE(replaces(UncertainRotation{true, 0}));
  EXPECT_FALSE(replaces(UncertainRotation{false, 0.1}));
  EXPECT_TRUE(replaces(ChosenValue{}));
}

TEST(Draw, ChoicesByTheirWeights) {
  const UncertainValue choice = ChosenValue{{1, 1, 4}};  // weights 1, 0, 3
  std::vector<int> counts(3, 0);
  for (std::uint64_t k = 0; k < kDraws; ++k) {
    const std::vector<double> u{unit_number(10, k, 0)};
    ++counts[static_cast<std::size_t>(draw_value(choice, {}, u).numbers[0])];
  }
  EXPECT_EQ(counts[1], 0);
  EXPECT_NEAR(counts[0], kDraws / 4, 5 * std::sqrt(kDraws * 0.1875));
}

}  // namespace draw_distribution_test
}  // namespace grapnel
