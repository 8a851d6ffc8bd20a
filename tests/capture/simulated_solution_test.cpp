/// Newton's method on flights, with a formula in the place of a flight.

#include "grapnel/approach/simulated_solution.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace grapnel {
namespace simulated_solution_test {

constexpr double kNone = std::numeric_limits<double>::infinity();

// Two errors of three positions and one rate-like coupling; the demanded rates depend on both.
SimulatedEnd flight(const std::vector<double>& x, const std::vector<double>& r) {
  SimulatedEnd end;
  end.error = Eigen::Vector2d(std::sin(x[0]) + 0.5 * x[1] - 0.3 + 0.1 * r[0], x[1] * x[2] + x[0] - 0.2 - 0.05 * r[2]);
  end.gap = Eigen::Vector3d(0.2 * x[0] - r[0] + 0.1 * r[1], std::cos(x[1]) - 1 - r[1], 0.3 * x[2] - 0.1 * r[0] - r[2]);
  return end;
}

TEST(SimulatedSolution, ErrorAndGapVanish) {
  const SimulatedSolution s =
      solve_by_simulations(flight, {0.4, 0.2, 0.6}, {0, 0, 0}, {-kNone, -kNone, -kNone}, {kNone, kNone, kNone}, 1e-10);
  ASSERT_TRUE(s.found);
  const SimulatedEnd end = flight(s.position, s.rate);
  EXPECT_LT(end.error.norm(), 1e-10);
  EXPECT_LT(end.gap.norm(), 1e-10);
  EXPECT_LE(s.iterations, 10);
}

TEST(SimulatedSolution, StaysWithinLimits) {
  const SimulatedSolution s =
      solve_by_simulations(flight, {0.1, 0.2, 0.1}, {0, 0, 0}, {-1, -1, -1}, {0.15, 1, kNone}, 1e-10);
  ASSERT_TRUE(s.found);
  EXPECT_LE(s.position[0], 0.15);
  EXPECT_LT(flight(s.position, s.rate).size(), 1e-10);
}

TEST(SimulatedSolution, SearchesRatesOnlyWithoutLimits) {
  const SimulatedSolution s = solve_by_simulations(flight, {0.4, 0.2, 0.6}, {0, 0, 0}, {}, {}, 1e-10);
  EXPECT_EQ(s.position, (std::vector<double>{0.4, 0.2, 0.6}));
  EXPECT_LT(flight(s.position, s.rate).gap.norm(), 1e-10);
}

TEST(SimulatedSolution, ReportsNoSolution) {
  const Flight unreachable = [](const std::vector<double>& x, const std::vector<double>&) {
    SimulatedEnd end;
    end.error = Eigen::VectorXd::Constant(1, 1 + x[0] * x[0]);
    end.gap = Eigen::VectorXd::Zero(1);
    return end;
  };
  const SimulatedSolution s = solve_by_simulations(unreachable, {0.5}, {0}, {-kNone}, {kNone}, 1e-10);
  EXPECT_FALSE(s.found);
  EXPECT_GE(s.end.error[0], 1);
  EXPECT_LT(s.end.error[0], 1.3);
}

}  // namespace simulated_solution_test
}  // namespace grapnel
