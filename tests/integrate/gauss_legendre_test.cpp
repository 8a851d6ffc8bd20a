/// Gauss-Legendre collocation: exactness of quadrature and stages, order, and invariants.

#include "grapnel/integrate/gauss_legendre.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace grapnel {
namespace gauss_legendre_test {

TEST(GaussLegendre, IntegratesPolynomialsOfDegreeTwiceItsStages) {
  for (int m : {2, 3, 5, 16, 24}) {
    const GaussLegendre gauss(m);
    ASSERT_EQ(gauss.stages(), m);
    for (int degree = 0; degree < 2 * m; ++degree) {
      double sum = 0;
      for (int i = 0; i < m; ++i) sum += gauss.weight(i) * std::pow(gauss.node(i), degree);
      EXPECT_NEAR(sum, 1.0 / (degree + 1), 2e-15) << m << " stages, degree " << degree;
    }
    double beyond = 0;
    for (int i = 0; i < m; ++i) beyond += gauss.weight(i) * std::pow(2 * gauss.node(i) - 1, 2 * m);
    if (m < 16) {
      EXPECT_GT(std::abs(beyond - 1.0 / (2 * m + 1)), 1e-8) << m;
    }
  }
}

TEST(GaussLegendre, StagesIntegratePolynomialsBelowTheirNumber) {
  for (int m : {2, 5, 16}) {
    const GaussLegendre gauss(m);
    for (int degree = 0; degree < m; ++degree) {
      for (int i = 0; i < m; ++i) {
        double sum = 0;
        for (int j = 0; j < m; ++j) sum += gauss.a(i, j) * std::pow(gauss.node(j), degree);
        EXPECT_NEAR(sum, std::pow(gauss.node(i), degree + 1) / (degree + 1), 2e-15);
      }
    }
  }
}

TEST(GaussLegendre, LastCoefficientsAreThoseOfLegendrePolynomials) {
  const int m = 6;
  const GaussLegendre gauss(m);
  const auto sums = [&](auto&& f) {
    std::pair<double, double> result{0, 0};
    for (int i = 0; i < m; ++i) {
      const double x = 2 * gauss.node(i) - 1;
      result.first += gauss.last(i) * f(x), result.second += gauss.last_but_one(i) * f(x);
    }
    return result;
  };
  // P_5 and P_4; below, nothing.
  const auto five = sums([](double x) { return (63 * std::pow(x, 5) - 70 * std::pow(x, 3) + 15 * x) / 8; });
  const auto four = sums([](double x) { return (35 * std::pow(x, 4) - 30 * x * x + 3) / 8; });
  const auto three = sums([](double x) { return 2 + x - 7 * std::pow(x, 3); });
  EXPECT_NEAR(five.first, 1, 1e-14);
  EXPECT_NEAR(five.second, 0, 1e-14);
  EXPECT_NEAR(four.first, 0, 1e-14);
  EXPECT_NEAR(four.second, 1, 1e-14);
  EXPECT_NEAR(three.first, 0, 1e-14);
  EXPECT_NEAR(three.second, 0, 1e-14);
}

// y' = c(t) y by two stages: order four.
TEST(GaussLegendre, HasTheOrderOfTwiceItsStages) {
  const GaussLegendre gauss(2);
  const auto error = [&](int steps) {
    double y = 1;
    const double h = 1.0 / steps;
    for (int n = 0; n < steps; ++n) {
      double c[2], k[2];
      for (int i = 0; i < 2; ++i) c[i] = std::cos(3 * h * (n + gauss.node(i)));
      k[0] = k[1] = 0;
      for (int iteration = 0; iteration < 60; ++iteration) {
        const double a = c[0] * (y + h * (gauss.a(0, 0) * k[0] + gauss.a(0, 1) * k[1]));
        const double b = c[1] * (y + h * (gauss.a(1, 0) * k[0] + gauss.a(1, 1) * k[1]));
        k[0] = a, k[1] = b;
      }
      y += h * (gauss.weight(0) * k[0] + gauss.weight(1) * k[1]);
    }
    return std::abs(y - std::exp(std::sin(3.0) / 3));
  };
  EXPECT_NEAR(std::log2(error(8) / error(16)), 4, 0.1);
}

TEST(GaussLegendre, NeedsTwoStages) { EXPECT_THROW(GaussLegendre(1), std::invalid_argument); }

}  // namespace gauss_legendre_test
}  // namespace grapnel
