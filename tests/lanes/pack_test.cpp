// Packs against plain doubles with std::fma for fused operations, bit by bit, for every supported instruction set.
// Compiled with -ffp-contract=off.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "grapnel/spatial/dispatch.hpp"
#include "lane_kernels/kernel_table.hpp"
#include "lanes/pack_checks.hpp"

namespace grapnel::lanes {
namespace pack_test {

using namespace testing;

const PackChecks& checks(InstructionSet set) {
  return *of_set(set, []<class Set>(std::type_identity<Set>) { return &pack_checks_of<Set>(); });
}

// All pairs and triples of these values, then random ones whose products and sums cancel.
struct Triples {
  std::vector<double> a, b, c;
  void add(double x, double y, double z) { a.push_back(x), b.push_back(y), c.push_back(z); }
  int count() const { return static_cast<int>(a.size()); }
};
Triples triples() {
  Triples t;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const double special[] = {0.0, -0.0, 1.0, -1.0, 0.1, 3.0, -1e-308, 5e-324, 1e308, -1e308, inf, -inf, nan, 1 + 1e-15};
  for (const double x : special) {
    for (const double y : special) {
      for (const double z : special) t.add(x, y, z);
    }
  }
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int i = 0; i < 4000; ++i) {
    const double x = uniform(generator), y = uniform(generator);
    t.add(x, y, i % 2 == 0 ? -x * y : uniform(generator));
  }
  while (t.count() % 8 != 0) t.add(1, 2, 3);
  return t;
}

double expected(PackResult k, double a, double b, double c, bool fused) {
  const auto fma = [fused](double x, double y, double z) { return fused ? std::fma(x, y, z) : x * y + z; };
  switch (k) {
    case kSum:
      return a + b;
    case kDifference:
      return a - b;
    case kProduct:
      return a * b;
    case kQuotient:
      return a / b;
    case kNegative:
      return -a;
    case kRoot:
      return std::sqrt(a);
    case kMagnitude:
      return std::abs(a);
    case kSmaller:
      return a < b ? a : b;
    case kLarger:
      return a > b ? a : b;
    case kProductPlus:
    case kPlusProduct:
    case kAddedProduct:
      return fma(a, b, c);
    case kProductMinus:
      return fma(a, b, -c);
    case kMinusProduct:
    case kTakenProduct:
    case kNegativeProduct:
      return fma(-a, b, c);
    case kTwoProducts:
      return fma(a, b, b * c);
    case kProductsApart:
      return fma(a, b, -(b * c));
    case kThreeProducts:
      return fma(-c, a, fma(a, b, b * c));
    case kMixed:
      return 2 * fma(-0.5, b, a) / 3;
    case kSelected:
      return a * b < c ? a : b;
    case kEqual:
      return a == b;
    case kUnequal:
      return a != b;
    case kLess:
      return a < b;
    case kLessOrEqual:
      return a <= b;
    case kGreater:
      return a > b;
    case kGreaterOrEqual:
      return a >= b;
    case kBoth:
      return a < b && b < c;
    case kEither:
      return a < b || b < c;
    case kNeither:
      return !(a < b || b < c);
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

bool same(double x, double y) {
  return (std::isnan(x) && std::isnan(y)) || std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
}

class PackTest : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(PackTest, ArithmeticRoundsAsSpecified) {
  const PackChecks& pack = checks(GetParam());
  const bool fused = GetParam() != InstructionSet::sse2;
  const Triples t = triples();
  std::vector<double> out(static_cast<std::size_t>(kPackResults * t.count()));
  pack.arithmetic(t.a.data(), t.b.data(), t.c.data(), out.data(), t.count());
  for (int k = 0; k < kPackResults; ++k) {
    for (int i = 0; i < t.count(); ++i) {
      const double x = out[static_cast<std::size_t>(k * t.count() + i)];
      const double y = expected(static_cast<PackResult>(k), t.a[i], t.b[i], t.c[i], fused);
      ASSERT_TRUE(same(x, y)) << "result " << k << " of " << t.a[i] << ", " << t.b[i] << ", " << t.c[i] << ": " << x
                              << " instead of " << y;
    }
  }
}

// Checks that some cases depend on fusion; otherwise the previous test could not detect a set that never fuses.
TEST_P(PackTest, SomeProductsNeedOneRounding) {
  const Triples t = triples();
  int different = 0;
  for (int i = 0; i < t.count(); ++i) {
    different += !same(expected(kProductPlus, t.a[i], t.b[i], t.c[i], true),
                       expected(kProductPlus, t.a[i], t.b[i], t.c[i], false));
  }
  EXPECT_GT(different, 1000);
}

TEST_P(PackTest, MasksAndLanesAreAccessible) { EXPECT_EQ(checks(GetParam()).masks(), 0); }

// 2 atan2(s, |w|) / s in all octants, near their borders, for quaternions of any norm, and for vanishing s.
TEST_P(PackTest, QuaternionAnglesAgreeWithTheLibrary) {
  std::vector<double> s, w;
  const double borders[] = {0, 1e-200, 1e-9, 0.1, M_PI / 8, 0.5, M_PI / 4, 1, 3 * M_PI / 8, 1.3, M_PI / 2};
  for (const double angle : borders) {
    for (const double step : {-1e-15, 0.0, 1e-15}) {
      for (const double size : {0.5, 1.0, 1.7}) {
        for (const double sign : {-1.0, 1.0})
          s.push_back(size * std::abs(std::sin(angle + step))), w.push_back(sign * size * std::cos(angle + step));
      }
    }
  }
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> uniform(0, M_PI / 2);
  while (s.size() < 4000 || s.size() % 8 != 0) {
    const double angle = uniform(generator);
    s.push_back(std::sin(angle)), w.push_back(std::cos(angle));
  }
  std::vector<double> out(s.size()), reference(s.size());
  checks(GetParam()).turns(s.data(), w.data(), out.data(), static_cast<int>(s.size()));
  checks(InstructionSet::one_lane).turns(s.data(), w.data(), reference.data(), static_cast<int>(s.size()));
  double worst = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const long double ls = s[i], size = std::abs(static_cast<long double>(w[i]));
    const long double turn = (w[i] < 0 ? -1 : 1) * (ls == 0 ? 2 / size : 2 * std::atan2(ls, size) / ls);
    worst = std::max(worst, static_cast<double>(std::abs(out[i] / turn - 1)));
    if (GetParam() == InstructionSet::sse2) continue;
    ASSERT_TRUE(same(out[i], reference[i])) << s[i] << ", " << w[i];
  }
  EXPECT_LT(worst, 1e-15);  // measured 3.7e-16
  std::printf("[ measured ] relative error %.2g\n", worst);
}

TEST_P(PackTest, WidthMatchesTheSet) {
  EXPECT_EQ(checks(GetParam()).width, lane_count(GetParam()));
  EXPECT_EQ(kernels(GetParam()).width, lane_count(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Sets, PackTest, ::testing::ValuesIn(supported_instruction_sets()),
                         [](const auto& set) { return std::string(name(set.param)); });

}  // namespace pack_test
}  // namespace grapnel::lanes
