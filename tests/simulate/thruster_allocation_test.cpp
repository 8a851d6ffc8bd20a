/// Minimum-propellant on-times of thrusters against enumeration of all corners for random arrays.

#include "grapnel/simulate/thruster_allocation.hpp"
#include "grapnel/spatial/decompositions.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/random_robot.hpp"

namespace grapnel::testing {
namespace thruster_allocation_test {

// The minimum cost over all corners: bases of as many columns as rows with nonnegative solutions.
double cheapest_corner(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c) {
  const auto m = A.rows(), n = A.cols();
  double least = std::numeric_limits<double>::infinity();
  std::vector<bool> chosen(static_cast<std::size_t>(n), false);
  std::fill(chosen.begin(), chosen.begin() + m, true);
  do {
    Eigen::MatrixXd B(m, m);
    Eigen::VectorXd cost(m);
    Eigen::Index k = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (chosen[static_cast<std::size_t>(j)]) B.col(k) = A.col(j), cost[k++] = c[j];
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(B);
    if (!lu.isInvertible()) continue;
    const Eigen::VectorXd x = lu.solve(b);
    if (x.minCoeff() >= -1e-9) least = std::min(least, cost.dot(x));
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
  return least;
}

TEST(MinCost, OptimalCorner) {
  Random random(180);
  int solved = 0, impossible = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int m = 2 + trial % 3, n = m + 1 + trial % 5;
    Eigen::MatrixXd A(m, n);
    Eigen::VectorXd b(m), c(n);
    for (int i = 0; i < m; ++i) {
      b[i] = random.uniform(-1, 1);
      for (int j = 0; j < n; ++j) A(i, j) = random.uniform(-1, 1);
    }
    for (int j = 0; j < n; ++j) c[j] = random.uniform(0.1, 1);
    const double best = cheapest_corner(A, b, c);
    const std::optional<Eigen::VectorXd> x = min_cost(A, b, c);
    ASSERT_EQ(x.has_value(), std::isfinite(best)) << "trial " << trial;
    if (!x) {
      ++impossible;
      continue;
    }
    ++solved;
    EXPECT_LT((A * *x - b).norm(), 1e-12 * std::max(1.0, x->norm()));
    EXPECT_GE(x->minCoeff(), 0);
    EXPECT_NEAR(c.dot(*x), best, 1e-9 * best) << "trial " << trial;
  }
  EXPECT_GT(solved, 50);
  EXPECT_GT(impossible, 50);
}

TEST(MinCost, DropsRedundantRows) {
  Eigen::MatrixXd A(3, 3);
  A << 1, -1, 2, 2, -2, 4, 0, 0, 0;
  const Eigen::Vector3d c(1, 1, 3);
  const auto x = min_cost(A, Eigen::Vector3d(2, 4, 0), c);
  ASSERT_TRUE(x);
  EXPECT_NEAR((*x)[0], 2, 1e-14);  // 2 units at cost 1 each, not 1 unit of the third at cost 3
  EXPECT_FALSE(min_cost(A, Eigen::Vector3d(2, 5, 0), c));
  EXPECT_FALSE(min_cost(A, Eigen::Vector3d(2, 4, 1), c));
  EXPECT_EQ(min_cost(A, Eigen::Vector3d::Zero(), c)->norm(), 0);
  EXPECT_THROW(min_cost(A, Eigen::Vector2d::Zero(), c), std::invalid_argument);
}

// Couples of opposite thrusters about each axis.
std::vector<Thruster> couples(double force = 2) {
  std::vector<Thruster> thrusters;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      for (const double sense : {1.0, -1.0}) {
        Thruster t;
        t.position[(axis + 1) % 3] = side;
        t.direction = Vector3d::zero();
        t.direction[(axis + 2) % 3] = side * sense;  // a torque about `axis` with the sign `sense`
        t.force = force, t.specific_impulse = 200;
        thrusters.push_back(t);
      }
    }
  }
  return thrusters;
}

TEST(ThrusterAllocation, PureTorqueIfPossible) {
  const std::vector<Thruster> array = couples();
  const ThrusterAllocation allocation(array, {0, 0, 0});
  EXPECT_TRUE(allocation.is_pure());
  const Vector3d wanted{0.3, -0.7, 0.2};
  const auto t = allocation.on_times(wanted);
  ASSERT_TRUE(t);
  Vector3d torque = Vector3d::zero(), force = Vector3d::zero();
  double used = 0;
  for (std::size_t i = 0; i < array.size(); ++i) {
    EXPECT_GE((*t)[i], 0);
    force += (*t)[i] * array[i].force * array[i].direction;
    torque += (*t)[i] * allocation.torque(i);
    used += (*t)[i] * mass_flow(array[i]);
  }
  EXPECT_LT(norm(torque - wanted), 1e-15);
  EXPECT_LT(norm(force), 1e-15);
  // Levers of 1 m: two thrusters of 2 N give 4 N m, for the time |torque| / 4.
  EXPECT_NEAR(used, 1.2 / 4 * 2 * mass_flow(array[0]), 1e-15);
}

TEST(ThrusterAllocation, ReportsInfeasibleTorque) {
  std::vector<Thruster> array = couples();
  array.resize(8);  // no torque about z
  const ThrusterAllocation allocation(array, {0, 0, 0});
  EXPECT_TRUE(allocation.is_pure());
  EXPECT_TRUE(allocation.can_provide({0, -1, 0}));
  EXPECT_FALSE(allocation.can_provide({0, 0, 1}));
  array.erase(array.begin());  // an incomplete couple: torque is available only together with a force
  EXPECT_FALSE(ThrusterAllocation(array, {0, 0, 0}).is_pure());
}

// Torques are about the given point, and the cost is propellant, not time.
TEST(ThrusterAllocation, AboutPointWithMinimumPropellant) {
  std::vector<Thruster> thrusters(3);
  for (Thruster& t : thrusters) t.direction = {0, 1, 0};
  thrusters[0].position = {1, 0, 0}, thrusters[0].force = 2, thrusters[0].specific_impulse = 100;
  thrusters[1].position = {1, 0, 0.5}, thrusters[1].force = 1, thrusters[1].specific_impulse = 300;
  thrusters[2].position = {1, 0, -0.5}, thrusters[2].force = 1, thrusters[2].specific_impulse = 300;
  const Vector3d about{0.2, 0.1, 0};
  const ThrusterAllocation allocation(thrusters, about);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d torque = cross(thrusters[i].position - about, thrusters[i].force * thrusters[i].direction);
    EXPECT_LT(norm(allocation.torque(i) - torque), 1e-15);
  }
  // Torque about z: either by the first alone, in 1 s with 2/100 of propellant, or by the others, in 1 s each with
  // 2/300.
  const auto times = allocation.on_times({0, 0, 1.6});
  ASSERT_TRUE(times);
  EXPECT_NEAR((*times)[0], 0, 1e-14);
  EXPECT_NEAR((*times)[1], 1, 1e-13);
  EXPECT_NEAR((*times)[2], 1, 1e-13);
}

TEST(Thruster, DirectionIncludesMisalignment) {
  Thruster t;
  t.direction = {1, 0, 0};
  t.misalignment = {0, 0, 0.1};
  EXPECT_LT(norm(thrust_direction(t) - Vector3d{std::cos(0.1), std::sin(0.1), 0}), 1e-15);
}

}  // namespace thruster_allocation_test
}  // namespace grapnel::testing
