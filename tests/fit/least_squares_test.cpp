// The search for least squares: curved valleys, bounds, points that cannot be evaluated.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "grapnel/compare/least_squares.hpp"

namespace grapnel {
namespace least_squares_test {

Eigen::VectorXd of(std::initializer_list<double> x) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(x.size()));
  std::copy(x.begin(), x.end(), v.begin());
  return v;
}

// Rosenbrock's valley, in units of a noise of 1e-3.
LeastSquares valley(double lower, double upper) {
  LeastSquares problem;
  problem.lower = of({lower, -10}), problem.upper = of({upper, 10});
  problem.residuals = [](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> {
    return Eigen::VectorXd(1e3 * of({10 * (x[1] - x[0] * x[0]), 1 - x[0]}));
  };
  problem.jacobian = [](const Eigen::VectorXd& x) -> std::optional<Eigen::MatrixXd> {
    Eigen::MatrixXd J(2, 2);
    J << -20 * x[0], 10, -1, 0;
    return Eigen::MatrixXd(1e3 * J);
  };
  return problem;
}

TEST(LeastSquares, FollowsACurvedValley) {
  const auto found = minimize_squares(valley(-10, 10), of({-1.2, 1}), 100);
  ASSERT_TRUE(found && found->converged);
  EXPECT_NEAR(found->x[0], 1, 1e-4);  // measured 1e-9
  EXPECT_LT(found->iterations, 60u);  // measured 16
}

TEST(LeastSquares, EndsAtABound) {
  // With x <= 0.5 the residuals are least at (0.5, 0.25).
  const auto found = minimize_squares(valley(-10, 0.5), of({-1.2, 1}), 100);
  ASSERT_TRUE(found && found->converged);
  EXPECT_EQ(found->x[0], 0.5);
  EXPECT_NEAR(found->x[1], 0.25, 1e-5);  // measured 1e-9
  // A variable held by equal bounds does not move, and the other one is least for it.
  const auto held = minimize_squares(valley(0.3, 0.3), of({0.3, 1}), 100);
  ASSERT_TRUE(held && held->converged);
  EXPECT_EQ(held->x[0], 0.3);
  EXPECT_NEAR(held->x[1], 0.09, 1e-5);
}

// A narrow valley along which both variables pass their bounds; only the first of them ends there.
TEST(LeastSquares, HoldsOnlyTheVariablesThatReachTheirBoundsFirst) {
  Eigen::MatrixXd J(2, 2);
  J << 1000, 2000, 1, -1;
  LeastSquares problem;
  problem.lower = of({0, 0}), problem.upper = of({1, 1});
  problem.residuals = [J](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> {
    return Eigen::VectorXd(J * x - of({1500, 19}));
  };
  problem.jacobian = [J](const Eigen::VectorXd&) { return std::optional(J); };
  for (const double start : {0.5, 0.0, 1.0}) {
    const auto found = minimize_squares(problem, of({start, 0.5}), 100);
    ASSERT_TRUE(found && found->converged);
    EXPECT_EQ(found->x[0], 1);
    EXPECT_NEAR(found->x[1], 0.25, 1e-4);
  }
}

// Random linear problems in a box: at the end no variable can reduce the sum of squares alone.
TEST(LeastSquares, EndsAtTheMinimumOfABox) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::size_t at_bounds = 0;
  for (int k = 0; k < 300; ++k) {
    const Eigen::Index n = 2 + k % 4;
    Eigen::MatrixXd J(n + 2, n);
    Eigen::VectorXd r(n + 2), start(n);
    for (double& x : J.reshaped()) x = 1e3 * normal(random);
    for (Eigen::Index c = 1; c < n; ++c) J.col(c) = J.col(0) + 0.03 * J.col(c);
    for (double& x : r) x = 1e3 * normal(random);
    for (double& x : start) x = 0.5 + 0.1 * normal(random);
    LeastSquares problem;
    problem.lower = Eigen::VectorXd::Zero(n), problem.upper = Eigen::VectorXd::Ones(n);
    problem.residuals = [&](const Eigen::VectorXd& x) { return std::optional<Eigen::VectorXd>(r + J * x); };
    problem.jacobian = [&](const Eigen::VectorXd&) { return std::optional(J); };
    const auto found = minimize_squares(problem, start, 100);
    ASSERT_TRUE(found && found->converged) << k;
    const Eigen::VectorXd gradient = J.transpose() * found->residuals;
    for (Eigen::Index c = 0; c < n; ++c) {
      const double x = found->x[c], size = J.col(c).norm();
      const bool is_low = x <= 0, is_high = x >= 1;
      at_bounds += is_low || is_high ? 1 : 0;
      // The reduction by this variable alone.
      const double towards = -gradient[c] / (size * size);
      const double to = std::clamp(x + towards, 0.0, 1.0) - x;
      EXPECT_LT(-(2 * gradient[c] * to + size * size * to * to), 1e-2) << k;
    }
  }
  EXPECT_GT(at_bounds, 300u);
}

TEST(LeastSquares, RejectsStepsThatCannotBeEvaluated) {
  LeastSquares problem = valley(-10, 10);
  const auto all = problem.residuals;
  std::size_t refused = 0;
  problem.residuals = [&](const Eigen::VectorXd& x) -> std::optional<Eigen::VectorXd> {
    if (x[1] < -0.5 || x[1] > 1.5) {
      ++refused;
      return std::nullopt;
    }
    return all(x);
  };
  const auto found = minimize_squares(problem, of({-1.2, 1}), 100);
  ASSERT_TRUE(found && found->converged);
  EXPECT_NEAR(found->x[0], 1, 1e-4);
  EXPECT_GT(refused, 0u);
  EXPECT_FALSE(minimize_squares(problem, of({0, 2}), 100));
}

TEST(LeastSquares, StatesThatItStoppedTooEarly) {
  const auto found = minimize_squares(valley(-10, 10), of({-1.2, 1}), 2);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->converged);
}

}  // namespace least_squares_test
}  // namespace grapnel
