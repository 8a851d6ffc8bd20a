/// The scales of the conservation checks: positive, in the proportions of the units, and no larger than they need be.

#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/capture/ledger_scale.hpp"

namespace grapnel::testing {
namespace ledger_scale_test {

// A group of 100 kg and 0.5 m that moves at 0.1 m/s and 0.2 rad/s, in a run of 100 s.
const GroupScale<double> kMotion{10, 5, 0.5};
const GroupReach kReach{100, 0.5, 2};
const SlowestMotion kRun{0.01, 0.1};

TEST(LedgerScale, OrdinaryMotionScalesWithItsSize) {
  const GroupScale<double> scale = ledger_scale(kMotion, {}, kReach, kRun);
  EXPECT_EQ(scale.linear, kMotion.linear);
  EXPECT_EQ(scale.angular, kMotion.angular);
  EXPECT_EQ(scale.energy, kMotion.energy);
}

TEST(LedgerScale, GroupAtRestHasFloor) {
  const GroupScale<double> scale = ledger_scale({0, 0, 0}, {}, kReach, kRun);
  EXPECT_NEAR(scale.linear, 100 * 3e-2 * 0.5 * 0.01, 1e-15);  // three hundredths of its radius in the run
  EXPECT_NEAR(scale.angular, 0.5 * scale.linear, 1e-15);
  EXPECT_NEAR(scale.energy, 0.5 * scale.linear * scale.linear / 100, 1e-18);
  // An impact alone takes no time: the speeds of the run are left.
  const GroupScale<double> at_once = ledger_scale({0, 0, 0}, {}, kReach, {0, 0.1});
  EXPECT_GT(at_once.linear, 0);
  EXPECT_GT(at_once.angular, 0);
  EXPECT_GT(at_once.energy, 0);
}

TEST(LedgerScale, IncludesExchange) {
  const GroupScale<double> scale = ledger_scale(kMotion, {1e4, 1e5, 1e3}, kReach, kRun);
  EXPECT_NEAR(scale.linear, 10 + 100, 1e-12);
  EXPECT_NEAR(scale.angular, 5 + 1000, 1e-12);
  EXPECT_NEAR(scale.energy, 0.5 + 10, 1e-12);
}

// A force through the centre of mass of what has come far exchanges no angular momentum, but has a rounded arm.
TEST(LedgerScale, IncludesPositionRounding) {
  const GroupReach far{100, 0.5, 5000};
  const double angular = ledger_scale({1000, 0, 0}, {1000, 0, 0}, far, kRun).angular;
  EXPECT_GT(1e-11 * angular, 4 * 2.2e-16 * 5000 * 1000);
  EXPECT_LT(1e-11 * angular, 20 * 2.2e-16 * 5000 * 1000);
}

// Units of mass, length and time scale what is measured and what it is measured against alike.
TEST(LedgerScale, FollowsUnits) {
  const TreeExchange exchanged{30, 20, 4};
  const GroupScale<double> scale = ledger_scale(kMotion, exchanged, kReach, kRun);
  for (const double m : {1e-6, 1e3}) {
    for (const double l : {1e-3, 1e3}) {
      for (const double t : {1e-2, 1e4}) {
        const double p = m * l / t, h = p * l, e = h / t;
        const GroupScale<double> other = ledger_scale(
            {p * kMotion.linear, h * kMotion.angular, e * kMotion.energy},
            {p * exchanged.impulse, h * exchanged.angular_impulse, e * exchanged.work},
            {m * kReach.mass, l * kReach.radius, l * kReach.distance}, {kRun.rate / t, l / t * kRun.speed});
        EXPECT_NEAR(other.linear, p * scale.linear, 1e-12 * other.linear);
        EXPECT_NEAR(other.angular, h * scale.angular, 1e-12 * other.angular);
        EXPECT_NEAR(other.energy, e * scale.energy, 1e-12 * other.energy);
      }
    }
  }
}

}  // namespace ledger_scale_test
}  // namespace grapnel::testing
