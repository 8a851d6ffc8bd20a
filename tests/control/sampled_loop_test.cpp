/// Stability of sampled proportional-derivative loops: closed forms, delays, and tick-by-tick simulation.
#include "grapnel/control/sampled_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel::testing {
namespace sampled_loop_test {

SampledLoop one_axis(double inertia, double kp, double kd, double period, double delay = 0) {
  return {Eigen::MatrixXd::Constant(1, 1, 1 / inertia),
          Eigen::VectorXd::Constant(1, kp),
          Eigen::VectorXd::Constant(1, kd),
          {period, delay}};
}

// Jury's conditions of a double integrator behind a hold: kd T < 2 I and kp T < 2 kd.
TEST(SampledLoop, SingleAxisStabilityLimits) {
  EXPECT_NEAR(growth_per_tick(one_axis(3, 0, 3, 0.5)), 1, 1e-9);  // a position without stiffness stays
  EXPECT_LT(growth_per_tick(one_axis(3, 0.5, 11.9, 0.5)), 1);
  EXPECT_GT(growth_per_tick(one_axis(3, 0.5, 12.1, 0.5)), 1);
  EXPECT_LT(growth_per_tick(one_axis(3, 3.9, 1, 0.5)), 1);
  EXPECT_GT(growth_per_tick(one_axis(3, 4.1, 1, 0.5)), 1);
  EXPECT_NEAR(growth_per_tick(one_axis(1, 0, 14, 1)), 13, 1e-9);  // |1 - kd T/I|
}

TEST(SampledLoop, FindsTheLargestStableGains) {
  EXPECT_EQ(largest_stable_share(one_axis(3, 0.5, 11, 0.5)), 1);
  EXPECT_NEAR(largest_stable_share(one_axis(3, 1e-3, 48, 0.5)), 0.25, 1e-3);
  EXPECT_EQ(largest_stable_share(one_axis(3, 4.1, 1, 0.5)), 0);  // kp T > 2 kd for any scaling
}

// Two axes whose difference a closed loop constrains: the immovable direction is ignored.
TEST(SampledLoop, IgnoresImmovableDirections) {
  SampledLoop loop = one_axis(1, 0, 0, 0.5);
  loop.response = Eigen::Matrix2d{{0.5, 0.5}, {0.5, 0.5}};  // both move together: x'' = (u_1 + u_2)/2
  loop.kp = Eigen::Vector2d(0.2, 0.3), loop.kd = Eigen::Vector2d(3, 4);
  EXPECT_NEAR(growth_per_tick(loop), growth_per_tick(one_axis(2, 0.5, 7, 0.5)), 1e-9);
  EXPECT_EQ(largest_stable_share(loop), 1);
  loop.kd *= 4;
  EXPECT_NEAR(largest_stable_share(loop), 2.0 / 7, 2e-2);
}

// The state simulated tick by tick, with the effort acting after the delay.
double simulated_growth(double inertia, double kp, double kd, double period, double delay, int ticks) {
  double x = 1, v = 0;
  std::vector<double> efforts(static_cast<std::size_t>(ticks) + 1, 0.0);
  constexpr int kSteps = 64;
  double before = 1;
  for (int k = 0; k < ticks; ++k) {
    efforts[static_cast<std::size_t>(k)] = -kp * x - kd * v;
    const double h = period / kSteps;
    for (int s = 0; s < kSteps; ++s) {
      const double t = (k + (s + 0.5) / kSteps) * period - delay;
      const double u = t < 0 ? 0 : efforts[static_cast<std::size_t>(t / period)];
      x += h * v + 0.5 * h * h * u / inertia, v += h * u / inertia;
    }
    if (k == ticks / 2) before = std::hypot(x, v);
  }
  return std::pow(std::hypot(x, v) / before, 1.0 / (ticks - 1 - ticks / 2));
}

TEST(SampledLoop, DelaysAgreeWithSimulation) {
  for (const double delay : {0.0, 0.125, 0.5, 0.625, 1.0}) {
    for (const double kd : {0.5, 1.5, 4.0}) {
      const double expected = simulated_growth(1.3, 0.4, kd, 0.5, delay, 600);  // the phase of the errors varies
      EXPECT_NEAR(growth_per_tick(one_axis(1.3, 0.4, kd, 0.5, delay)), expected, 0.01) << delay << " " << kd;
    }
  }
}

}  // namespace sampled_loop_test
}  // namespace grapnel::testing
