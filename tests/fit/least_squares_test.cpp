// The search for least squares: curved valleys, bounds, points that cannot be evaluated.
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/fit/least_squares.hpp"

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
