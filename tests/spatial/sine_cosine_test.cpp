// Grapnel's sine and cosine against the long double functions of the C library.
#include "grapnel/spatial/sine_cosine.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace grapnel {
namespace sine_cosine_test {

// Distance in units in the last place of the exact value.
double ulps(double value, long double exact) {
  const double size = std::abs(static_cast<double>(exact));
  const double unit = std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
  return static_cast<double>(std::abs(value - exact) / unit);
}

struct Worst {
  double sine = 0, cosine = 0;
  void visit(double angle) {
    const SineCosine<double> r = sine_cosine(angle);
    sine = std::max(sine, ulps(r.sine, std::sin(static_cast<long double>(angle))));
    cosine = std::max(cosine, ulps(r.cosine, std::cos(static_cast<long double>(angle))));
  }
};

TEST(SineCosine, WithinOneUnitInTheLastPlace) {
  std::mt19937_64 generator(1);
  Worst worst;
  for (double range : {1e-300, 1e-8, 0.1, 1.0, 4.0, 1e2, 1e4, 1e5}) {
    std::uniform_real_distribution<double> uniform(-range, range);
    for (int i = 0; i < 100000; ++i) worst.visit(uniform(generator));
  }
  EXPECT_LT(worst.sine, 0.85);    // measured 0.77
  EXPECT_LT(worst.cosine, 0.85);  // measured 0.76
}

// Where the reduction cancels most: the doubles next to multiples of pi/2, and the ends of the quadrants.
TEST(SineCosine, WithinOneUnitNextToMultiplesOfAnEighthTurn) {
  Worst worst;
  for (int n = -60000; n <= 60000; ++n) {
    for (double step : {0.5, 1.0}) {
      const double angle = n * step * M_PI / 2;
      for (double x : {std::nextafter(angle, -1e9), angle, std::nextafter(angle, 1e9)}) worst.visit(x);
    }
  }
  EXPECT_LT(worst.sine, 0.85);    // measured 0.77
  EXPECT_LT(worst.cosine, 0.85);  // measured 0.77
}

TEST(SineCosine, ExactAtZero) {
  EXPECT_EQ(sine_cosine(0.0).sine, 0.0);
  EXPECT_EQ(sine_cosine(0.0).cosine, 1.0);
  EXPECT_TRUE(std::signbit(sine_cosine(-0.0).sine));
  EXPECT_EQ(sine_cosine(5e-324).sine, 5e-324);
}

TEST(SineCosine, LargeAnglesUseTheLibrary) {
  for (double angle : {1.0000001e5, -3e7, 1e22, 1e300}) {
    EXPECT_EQ(sine_cosine(angle).sine, std::sin(angle));
    EXPECT_EQ(sine_cosine(angle).cosine, std::cos(angle));
  }
}

TEST(SineCosine, PropagatesNaN) {
  for (double angle : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(sine_cosine(angle).sine));
    EXPECT_TRUE(std::isnan(sine_cosine(angle).cosine));
  }
}

}  // namespace sine_cosine_test
}  // namespace grapnel
