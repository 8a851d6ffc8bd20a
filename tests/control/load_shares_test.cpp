/// Loads that are affine in one number: the largest number within the limits, or the one with the least excess.
#include "grapnel/control/load_shares.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/random_robot.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace load_shares_test {

std::vector<LimitedLoad> random_loads(Random& random, double size) {
  std::vector<LimitedLoad> loads;
  const int n = random.integer(1, 12);
  for (int i = 0; i < n; ++i) {
    LimitedLoad load;
    const int components = random.integer(0, 1) == 1 ? 3 : 1;
    for (int k = 0; k < components; ++k)
      load.fixed[k] = random.uniform(-size, size), load.varied[k] = random.uniform(-1, 1);
    load.limit = random.uniform(0.5, 2);
    loads.push_back(load);
  }
  return loads;
}

// Compared with a fine grid search of the interval.
TEST(LoadShares, AgreeWithASearch) {
  int possible = 0, impossible = 0;
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const std::vector<LimitedLoad> loads = random_loads(random, i % 3 == 0 ? 3 : 0.8);
    const double most = random.uniform(0.1, 3);
    const LoadShare found = largest_within(loads, most);
    double best = -1, least = 1e300;
    constexpr int kSteps = 20000;
    for (int s = 0; s <= kSteps; ++s) {
      const double k = most * s / kSteps, share = share_at(loads, k).share;
      if (share <= 1) best = k;
      least = std::min(least, share);
    }
    if (best >= 0) {
      ++possible;
      EXPECT_NEAR(found.k, best, most / kSteps);
      EXPECT_LE(found.share, 1);
    } else {
      ++impossible;
      EXPECT_LE(found.share, least * (1 + 1e-12));
      EXPECT_GT(found.share, 1 - 1e-3);
    }
  }
  EXPECT_GT(possible, 50);
  EXPECT_GT(impossible, 50);
}

// The solution changes continuously as the limits become infeasible.
TEST(LoadShares, AreContinuousInTheLimits) {
  double largest = 0;
  for (int i = 0; i < test::repetitions(50); ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    std::vector<LimitedLoad> loads = random_loads(random, 2);
    constexpr int kSteps = 20000;
    double before = -1;
    for (int s = 0; s <= kSteps; ++s) {
      std::vector<LimitedLoad> scaled = loads;
      const double factor = 3.0 * s / kSteps;  // of the load at k = 0
      for (LimitedLoad& load : scaled) load.fixed *= factor;
      const double k = largest_within(scaled, 1.5).k;
      if (before >= 0) largest = std::max(largest, std::abs(k - before));
      before = k;
    }
  }
  std::printf("  largest change of k in a step %.3g\n", largest);
  EXPECT_LT(largest, 0.05);
}

TEST(LoadShares, WithoutLoadsTheShareIsMaximal) {
  const LoadShare found = largest_within({}, 0.7);
  EXPECT_EQ(found.k, 0.7);
  EXPECT_EQ(found.share, 0);
  EXPECT_EQ(found.load, -1);
}

}  // namespace load_shares_test
}  // namespace grapnel::testing
