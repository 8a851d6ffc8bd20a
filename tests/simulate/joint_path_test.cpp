/// Joint profiles: boundary values, derivatives, the thesis's printed formula.

#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/simulate/joint_trajectory.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace joint_path_test {

constexpr JointProfile kProfiles[] = {JointProfile::quartic, JointProfile::cycloidal, JointProfile::quintic};

JointPath random_path(JointProfile profile, Random& random) {
  return {profile,
          random.log_uniform(0.1, 100),
          random.uniform(-3, 3),
          random.uniform(-3, 3),
          random.uniform(-2, 2),
          random.uniform(-2, 2)};
}

TEST(JointPath, EndLimitsFromInside) {
  Worst worst("position, rate and acceleration just inside the ends");
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const JointPath path = random_path(kProfiles[i % 3], random);
    const double start_rate = path.profile == JointProfile::quartic ? 0.0 : path.start_rate;
    const double speed = std::abs(path.end - path.start) / path.duration + 4;
    for (double x : {1e-9, 1 - 1e-9}) {
      const JointPoint p = evaluate(path, x * path.duration);
      EXPECT_LT(worst.note(std::abs(p.position - (x < 0.5 ? path.start : path.end)) / (speed * path.duration), i),
                1e-8);
      EXPECT_LT(worst.note(std::abs(p.rate - (x < 0.5 ? start_rate : path.end_rate)) / speed, i), 1e-8);
      EXPECT_LT(worst.note(std::abs(p.acceleration) * path.duration / speed, i), 1e-6);
    }
    // At and beyond the ends.
    for (double t : {-1.0, 0.0}) {
      const JointPoint p = evaluate(path, t);
      EXPECT_EQ(p.position, path.start);
      EXPECT_EQ(p.rate, start_rate);
      EXPECT_EQ(p.acceleration, 0);
    }
    for (double t : {path.duration, path.duration + 1}) {
      const JointPoint p = evaluate(path, t);
      EXPECT_EQ(p.position, path.end);
      EXPECT_EQ(p.rate, path.end_rate);
      EXPECT_EQ(p.acceleration, 0);
    }
  }
}

TEST(JointPath, RateAndAccelerationAreDerivatives) {
  Worst worst("rate and acceleration against differences");
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const JointPath path = random_path(kProfiles[i % 3], random);
    const double t = random.uniform(0.01, 0.99) * path.duration, h = 1e-3 * path.duration;
    const auto slope = [&](auto of) {
      return (8 * (of(t + h) - of(t - h)) - (of(t + 2 * h) - of(t - 2 * h))) / (12 * h);
    };
    const double speed = std::abs(path.end - path.start) / path.duration + 4;
    const JointPoint p = evaluate(path, t);
    EXPECT_LT(worst.note(std::abs(slope([&](double s) { return evaluate(path, s).position; }) - p.rate) / speed, i),
              1e-9);
    EXPECT_LT(worst.note(std::abs(slope([&](double s) { return evaluate(path, s).rate; }) - p.acceleration) / speed *
                             path.duration,
                         i),
              1e-8);
  }
}

// (3.1) and (3.2) as printed: rate = dtheta/T (a x^2 + b x^3 + c x^4) with x = t/T and s = rate(T) T/dtheta.
TEST(JointPath, QuarticMatchesPrintedFormula) {
  Worst worst("rate against (3.1)-(3.2)");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const JointPath path = random_path(JointProfile::quartic, random);
    const double T = path.duration, travel = path.end - path.start, s = path.end_rate * T / travel;
    const double a = 3 * (-4 * s + 10), b = 4 * (7 * s - 15), c = 5 * (-3 * s + 6);
    // They are what makes the rate s at the end, with zero acceleration, and the travel dtheta.
    ASSERT_NEAR(a + b + c, s, 1e-9 * (1 + std::abs(s)));
    ASSERT_NEAR(2 * a + 3 * b + 4 * c, 0, 1e-9 * (1 + std::abs(s)));
    ASSERT_NEAR(a / 3 + b / 4 + c / 5, 1, 1e-9 * (1 + std::abs(s)));
    const double x = random.uniform(0, 1);
    const double rate = travel / T * (a * x * x + b * x * x * x + c * x * x * x * x);
    EXPECT_LT(worst.note(std::abs(evaluate(path, x * T).rate - rate) / (std::abs(travel) / T + 2), i), 1e-13);
  }
}

TEST(JointPath, ZeroTravelWithFinalRate) {
  for (JointProfile profile : kProfiles) {
    const JointPath path{profile, 4, 0.7, 0.7, 0, 0.3};
    EXPECT_EQ(evaluate(path, 0).position, 0.7);
    EXPECT_LT(evaluate(path, 2).position, 0.69);  // it swings back to come in with the rate
    EXPECT_NEAR(evaluate(path, 4 - 1e-9).position, 0.7, 1e-9);
    EXPECT_NEAR(evaluate(path, 4 - 1e-9).rate, 0.3, 1e-9);
  }
  const JointPath still{JointProfile::quartic, 4, 0.7, 0.7, 0, 0};
  EXPECT_EQ(evaluate(still, 1.3).position, 0.7);
  EXPECT_EQ(evaluate(still, 1.3).rate, 0);
}

TEST(JointPath, FromRestQuinticEqualsQuarticAndCycloidIsSine) {
  for (double x : {0.1, 0.37, 0.5, 0.9}) {
    const JointPath quartic{JointProfile::quartic, 3, -1, 0.5, 0, 0.2},
        quintic{JointProfile::quintic, 3, -1, 0.5, 0, 0.2};
    EXPECT_EQ(evaluate(quartic, 3 * x).position, evaluate(quintic, 3 * x).position);
    const JointPath cycloid{JointProfile::cycloidal, 3, -1, 0.5, 0, 0};
    EXPECT_NEAR(evaluate(cycloid, 3 * x).position, -1 + 1.5 * (x - std::sin(2 * M_PI * x) / (2 * M_PI)), 1e-15);
  }
}

}  // namespace joint_path_test
}  // namespace grapnel::testing
