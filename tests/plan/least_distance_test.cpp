/// The closest point subject to linear inequalities, by its optimality conditions.

#include "grapnel/plan/least_distance.hpp"

#include <gtest/gtest.h>

#include <random>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel::testing {
namespace least_distance_test {

Eigen::MatrixXd random_matrix(std::mt19937& generator, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns,
                                      [&] { return 2 * (static_cast<double>(generator()) * 0x1p-32) - 1; });
}

// x - c is a combination of active rows with nonnegative multipliers.
TEST(LeastDistance, IsMinimalForFeasibleRows) {
  double farthest = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 generator(seed);
    const Eigen::MatrixXd A = random_matrix(generator, 30, 12);
    const Eigen::VectorXd inside = random_matrix(generator, 12, 1), c = 3 * random_matrix(generator, 12, 1);
    const Eigen::VectorXd b = A * inside + random_matrix(generator, 30, 1).cwiseAbs();
    const LeastDistance found = nearest_below(A, b, c);
    const Eigen::VectorXd beyond = A * found.x - b;
    EXPECT_LT(beyond.maxCoeff(), 1e-7) << seed;
    EXPECT_LT(found.left, 1e-7) << seed;
    std::vector<Eigen::Index> holding;
    for (Eigen::Index i = 0; i < 30; ++i) {
      if (beyond[i] > -1e-7) holding.push_back(i);
    }
    farthest = std::max(farthest, (found.x - c).norm());
    if (holding.empty()) {
      EXPECT_EQ((found.x - c).norm(), 0);
      continue;
    }
    const Eigen::MatrixXd normals = A(holding, Eigen::all).transpose();
    const Eigen::VectorXd l = least_squares_solution(normals, Eigen::VectorXd(c - found.x));
    EXPECT_LT((normals * l - (c - found.x)).norm(), 1e-6) << seed;
    EXPECT_GT(l.minCoeff(), -1e-6) << seed;
  }
  EXPECT_GT(farthest, 1);
}

// Two rows that contradict each other by 1 are relaxed by a half each; other rows do not matter.
TEST(LeastDistance, RelaxesInfeasibleRowsEqually) {
  Eigen::MatrixXd A(3, 2);
  A << 1, 0, -1, 0, 0, 1;
  const Eigen::Vector3d b{0, -1, 5};
  const LeastDistance found = nearest_below(A, b, Eigen::Vector2d(7, 2));
  EXPECT_NEAR(found.left, 0.5, 1e-3);  // measured error 2.5e-4: the regularization of dependent rows
  EXPECT_NEAR(found.x[0], 0.5, 1e-6);
  EXPECT_NEAR(found.x[1], 2, 1e-6);
}

// Without rows the point is unchanged.
TEST(LeastDistance, WithoutRowsReturnsThePoint) {
  const Eigen::Vector3d c{1, -2, 3};
  const LeastDistance found = nearest_below(Eigen::MatrixXd(0, 3), Eigen::VectorXd(0), c);
  EXPECT_EQ(found.x, c);
  EXPECT_EQ(found.left, 0);
}

// Equivalent rows, including a weaker one and a multiple, move the point as a single row does.
TEST(LeastDistance, EqualRowsCountOnce) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 generator(seed);
    const Eigen::MatrixXd a = random_matrix(generator, 1, 6);
    const Eigen::VectorXd c = random_matrix(generator, 6, 1);
    const double bound = (a * c)(0) - 0.5;
    Eigen::MatrixXd A(5, 6);
    A << a, a, a, 2 * a, a;
    const Eigen::VectorXd b = (Eigen::VectorXd(5) << bound, bound, bound, 2 * bound, bound + 0.25).finished();
    const LeastDistance one = nearest_below(a, Eigen::VectorXd::Constant(1, bound), c), found = nearest_below(A, b, c);
    EXPECT_GT((one.x - c).norm(), 0.1);
    EXPECT_LT((found.x - one.x).norm(), 1e-7) << seed;  // measured 4e-9
    EXPECT_LT(found.left, 1e-7) << seed;
  }
  // Equal rows that contradict another by 1 are still relaxed by a half each.
  Eigen::MatrixXd A(4, 2);
  A << 1, 0, 1, 0, -1, 0, -1, 0;
  const Eigen::Vector4d b{0, 0, -1, -1};
  const LeastDistance found = nearest_below(A, b, Eigen::Vector2d(7, 2));
  EXPECT_NEAR(found.left, 0.5, 1e-3);
  EXPECT_NEAR(found.x[0], 0.5, 1e-6);
  EXPECT_NEAR(found.x[1], 2, 1e-6);
}

// A sequence of solutions, with e decreasing or increasing, equals the separate solutions.
TEST(LeastDistance, IsIndependentOfEarlierSolutions) {
  double different = 0, farthest = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 generator(seed);
    const Eigen::MatrixXd A = random_matrix(generator, 40, 12);
    const Eigen::VectorXd b = random_matrix(generator, 40, 1) - Eigen::VectorXd::Constant(40, 0.5),
                          c = random_matrix(generator, 12, 1);
    NearestBelow program(A, b, c);
    for (const double relaxation : {20.0, 1.0, 1e-2, 1e-4, 1e-3, 0.3, 1e-5}) {
      const LeastDistance found = program.with(relaxation), by_itself = nearest_below(A, b, c, relaxation);
      different = std::max(different, (found.x - by_itself.x).norm());
      farthest = std::max(farthest, (found.x - c).norm());
      EXPECT_NEAR(found.left, by_itself.left, 1e-7);
    }
  }
  EXPECT_LT(different, 1e-7);
  EXPECT_GT(farthest, 1);
}

// The distance decreases with the allowed relaxation.
TEST(LeastDistance, RelaxationReducesTheDistance) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Constant(1, 1, 2);
  const Eigen::VectorXd b = Eigen::VectorXd::Constant(1, -2), c = Eigen::VectorXd::Zero(1);
  double before = 1.001;
  for (const double relaxation : {1e-6, 0.1, 1.0, 10.0}) {
    const LeastDistance found = nearest_below(A, b, c, relaxation);
    EXPECT_LT(-found.x[0], before) << relaxation;
    EXPECT_NEAR(2 * found.x[0] + 2, found.left, 1e-9) << relaxation;
    before = -found.x[0];
  }
}

}  // namespace least_distance_test
}  // namespace grapnel::testing
