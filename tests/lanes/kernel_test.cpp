// The recursive kernels in lanes: against the scalar kernels, at every width, and independence of the other lanes.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "lanes/lane_cases.hpp"
#include "support/worst.hpp"

namespace grapnel::lanes {
namespace kernel_test {

using namespace testing;
using grapnel::testing::seed_note;
using grapnel::testing::Worst;

constexpr int kRobots = 100;

constexpr std::vector<double> LaneResults::*kParts[] = {
    &LaneResults::vdot, &LaneResults::force, &LaneResults::inverse, &LaneResults::momenta,
    &LaneResults::q,    &LaneResults::v,     &LaneResults::motion};

// Largest difference relative to the largest value.
double difference(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() != y.size()) return INFINITY;
  double size = 0, apart = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    size = std::max(size, std::abs(y[i]));
    apart = std::isnan(x[i]) || std::isnan(y[i]) ? INFINITY : std::max(apart, std::abs(x[i] - y[i]));
  }
  return apart == 0 ? 0 : apart / size;
}

bool same_bits(const std::vector<double>& x, const std::vector<double>& y) {
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  });
}
bool same_bits(const LaneResults& x, const LaneResults& y) {
  return std::all_of(std::begin(kParts), std::end(kParts), [&](auto part) { return same_bits(x.*part, y.*part); });
}

class LaneKernels : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(LaneKernels, AgreeWithScalarKernels) {
  Worst vdot("forward dynamics"), force("forces of prescribed joints"), inverse("inverse dynamics"),
      momenta("momenta of roots"), q("recovered positions"), v("recovered velocities"), motion("poses and twists");
  Worst* worst[] = {&vdot, &force, &inverse, &momenta, &q, &v, &motion};
  for (int robot = 0; robot < kRobots; ++robot) {
    SCOPED_TRACE(seed_note(robot));
    const CaseSet set = random_cases(robot);
    const std::array<LaneResults, kCases> lanes = lane_results(GetParam(), set);
    for (int i = 0; i < kCases; ++i) {
      const LaneResults expected = double_results(set.cases[i], set.prescribed);
      for (int part = 0; part < 7; ++part) {
        // Measured with avx512; 1e-13 results from a robot with an ill-conditioned mass matrix.
        ASSERT_LT(worst[part]->note(difference(lanes[i].*kParts[part], expected.*kParts[part]), robot), 1e-13) << part;
      }
    }
  }
}

TEST_P(LaneKernels, DoNotDependOnTheOtherLanes) {
  const std::array<int, kCases> other = {5, 2, 7, 0, 3, 6, 1, 4};
  for (int robot = 0; robot < kRobots / 4; ++robot) {
    SCOPED_TRACE(seed_note(robot));
    const CaseSet set = random_cases(robot);
    const std::array<LaneResults, kCases> lanes = lane_results(GetParam(), set);
    const std::array<LaneResults, kCases> permuted = lane_results(GetParam(), set, other);
    // All cases except one are replaced by NaN, infinities, and large angles.
    const int kept = robot % kCases;
    CaseSet spoilt = set;
    for (int i = 0; i < kCases; ++i) {
      if (i == kept) continue;
      LaneCase& c = spoilt.cases[i];
      const double garbage[] = {std::nan(""), INFINITY, 1e300};
      std::fill(c.q.begin(), c.q.end(), garbage[i % 3]);
      std::fill(c.v.begin(), c.v.end(), garbage[(i + 1) % 3]);
      for (TreeLink<double>& link : c.tree.links) link.inertia.mass = 0;
    }
    const std::array<LaneResults, kCases> beside = lane_results(GetParam(), spoilt);
    for (int i = 0; i < kCases; ++i) ASSERT_TRUE(same_bits(lanes[i], permuted[i])) << "case " << i;
    ASSERT_TRUE(same_bits(lanes[kept], beside[kept]));
  }
}

// Among the sets with fused products. The bits of SSE2 differ; otherwise this test would be vacuous.
TEST(LaneWidths, GiveTheSameBits) {
  int different = 0;
  for (int robot = 0; robot < kRobots; ++robot) {
    SCOPED_TRACE(seed_note(robot));
    const CaseSet set = random_cases(robot);
    const std::array<LaneResults, kCases> one = lane_results(InstructionSet::one_lane, set);
    for (const InstructionSet wide : supported_instruction_sets()) {
      const std::array<LaneResults, kCases> lanes = lane_results(wide, set);
      for (int i = 0; i < kCases; ++i) {
        if (wide == InstructionSet::sse2) {
          different += !same_bits(lanes[i], one[i]);
        } else {
          ASSERT_TRUE(same_bits(lanes[i], one[i])) << name(wide) << ", case " << i;
        }
      }
    }
  }
  EXPECT_GT(different, is_supported(InstructionSet::sse2) ? kRobots : -1);
}

// Distance in units in the last place of the exact value.
double ulps(double value, long double exact) {
  const double size = std::abs(static_cast<double>(exact));
  const double unit = std::nextafter(size, std::numeric_limits<double>::infinity()) - size;
  return static_cast<double>(std::abs(value - exact) / unit);
}

std::vector<double> angles() {
  std::vector<double> x = {0.0, -0.0,  5e-324, -1e-310,  1e5,       -1e5,        1.00001e5,
                           1e9, -3e22, 1e300,  INFINITY, -INFINITY, std::nan("")};
  grapnel::testing::Random random(1);
  for (const double range : {1e-8, 0.1, 1.0, 4.0, 1e2, 1e5, 1e6}) {
    for (int i = 0; i < 3000; ++i) x.push_back(random.uniform(-range, range));
  }
  for (int n = -2000; n <= 2000; ++n) {
    const double angle = n * M_PI / 4;
    for (const double y : {std::nextafter(angle, -1e9), angle, std::nextafter(angle, 1e9)}) x.push_back(y);
  }
  while (x.size() % 8 != 0) x.push_back(1);
  return x;
}

struct alignas(kLaneAlignment) Block {
  double x[8];
};
struct Results {
  std::vector<double> sine, cosine;
};
Results sines(InstructionSet set, const std::vector<double>& x) {
  Results r;
  for (std::size_t i = 0; i < x.size(); i += 8) {
    Block angle, sine, cosine;
    std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(i), 8, angle.x);
    kernels(set).sine_cosine(angle.x, sine.x, cosine.x, 8 / lane_count(set));
    r.sine.insert(r.sine.end(), sine.x, sine.x + 8);
    r.cosine.insert(r.cosine.end(), cosine.x, cosine.x + 8);
  }
  return r;
}

TEST_P(LaneKernels, SinesAreWithinOneUnitInTheLastPlace) {
  const std::vector<double> x = angles();
  const Results r = sines(GetParam(), x);
  Worst sine("sine, ulp"), cosine("cosine, ulp");
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i])) {
      EXPECT_TRUE(std::isnan(r.sine[i]) && std::isnan(r.cosine[i]));
      continue;
    }
    const long double angle = x[i];
    ASSERT_LT(sine.note(ulps(r.sine[i], std::sin(angle)), static_cast<int>(i)), 0.85) << x[i];
    ASSERT_LT(cosine.note(ulps(r.cosine[i], std::cos(angle)), static_cast<int>(i)), 0.85) << x[i];
  }
  EXPECT_TRUE(std::signbit(r.sine[1]));  // of -0
}

TEST(LaneWidths, GiveTheSameSines) {
  std::vector<double> x = angles();
  x.erase(std::remove_if(x.begin(), x.end(), [](double a) { return !std::isfinite(a); }), x.end());
  while (x.size() % 8 != 0) x.push_back(1);
  const Results one = sines(InstructionSet::one_lane, x);
  for (const InstructionSet wide : supported_instruction_sets()) {
    if (wide == InstructionSet::sse2) continue;
    const Results r = sines(wide, x);
    EXPECT_TRUE(same_bits(r.sine, one.sine) && same_bits(r.cosine, one.cosine)) << name(wide);
  }
}

INSTANTIATE_TEST_SUITE_P(Sets, LaneKernels, ::testing::ValuesIn(supported_instruction_sets()),
                         [](const auto& set) { return std::string(name(set.param)); });

TEST(Dispatch, FollowsTheEnvironment) {
  const auto with = [](const char* value) {
    setenv("GRAPNEL_LANES", value, 1);
    return best_instruction_set();
  };
  for (const InstructionSet set : supported_instruction_sets()) EXPECT_EQ(with(std::string(name(set)).c_str()), set);
  EXPECT_EQ(with("off"), std::nullopt);
  const InstructionSet widest = supported_instruction_sets().back();
  EXPECT_EQ(with(""), widest == InstructionSet::one_lane ? std::nullopt : std::optional(widest));
  try {
    with("avx3");
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("GRAPNEL_LANES is 'avx3'"), std::string::npos) << e.what();
  }
  unsetenv("GRAPNEL_LANES");
}

}  // namespace kernel_test
}  // namespace grapnel::lanes
