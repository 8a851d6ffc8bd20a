/// The projection behind every impact, on dense random problems without any mechanics.

#include <gtest/gtest.h>

#include "grapnel/constraint/impulsive_constraint.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impulsive_constraint_test {

constexpr int kCases = 300;

struct Problem {
  Eigen::MatrixXd M, J, D;
  Eigen::VectorXd v;
  int rank;
};

Eigen::MatrixXd random_matrix(Random& random, int rows, int columns) {
  Eigen::MatrixXd A(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) A(i, j) = random.uniform(-1, 1);
  }
  return A;
}

// Rows of J are combinations of `rank` independent ones, with very different magnitudes.
Problem random_problem(int index) {
  Random random(index);
  const int n = random.integer(3, 15), rank = random.integer(1, n), rows = rank + (index % 2) * random.integer(1, 6);
  Problem p;
  const Eigen::MatrixXd A = random_matrix(random, n, n), B = random_matrix(random, rows, rows);
  p.M = A * A.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
  p.D = B * B.transpose() + 0.1 * Eigen::MatrixXd::Identity(rows, rows);
  Eigen::MatrixXd mix = random_matrix(random, rows, rank);
  mix.topRows(rank) += 3 * Eigen::MatrixXd::Identity(rank, rank);
  p.J = mix * random_matrix(random, rank, n);
  p.v = random_matrix(random, n, 1);
  p.rank = rank;
  return p;
}

TEST(ImpulsiveConstraint, SolvesBothEquationsWithTheRightRank) {
  Worst momentum("|M dv - J^T P|"), constraint("|J v+|");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Problem p = random_problem(i);
    const ImpulsiveSolution s = solve_impulsive_constraint(p.M, p.J, p.v, p.D);
    EXPECT_EQ(s.rank, p.rank);
    EXPECT_EQ(s.null_space.cols(), p.J.rows() - p.rank);
    const Eigen::VectorXd change = p.M * (s.velocity - p.v);
    EXPECT_LT(momentum.note((change - p.J.transpose() * s.impulse).norm() / (p.M * p.v).norm(), i), 1e-10);
    EXPECT_LT(constraint.note((p.J * s.velocity).norm() / (p.J.norm() * p.v.norm()), i), 1e-12);
  }
}

TEST(ImpulsiveConstraint, NullSpaceHoldsSelfStressesAndTheImpulseIsMinimal) {
  Worst stress("|J^T N|"), slope("slope of P^T D P along N");
  for (int i = 1; i < kCases; i += 2) {
    SCOPED_TRACE(seed_note(i));
    const Problem p = random_problem(i);
    const ImpulsiveSolution s = solve_impulsive_constraint(p.M, p.J, p.v, p.D);
    ASSERT_GT(s.null_space.cols(), 0);
    EXPECT_LT(stress.note((p.J.transpose() * s.null_space).norm() / (p.J.norm() * s.null_space.norm()), i), 1e-12);
    EXPECT_EQ(Eigen::FullPivLU<Eigen::MatrixXd>(s.null_space).rank(), s.null_space.cols());
    const double size = (p.D * s.null_space).norm() * s.impulse.norm();
    EXPECT_LT(slope.note((s.null_space.transpose() * p.D * s.impulse).norm() / size, i), 1e-10);
  }
}

TEST(ImpulsiveConstraint, VelocityDoesNotDependOnTheMetric) {
  Worst worst("velocity under another metric");
  double largest = 0;
  for (int i = 1; i < kCases; i += 2) {
    SCOPED_TRACE(seed_note(i));
    const Problem p = random_problem(i);
    const ImpulsiveSolution s = solve_impulsive_constraint(p.M, p.J, p.v, p.D);
    const ImpulsiveSolution t =
        solve_impulsive_constraint(p.M, p.J, p.v, Eigen::MatrixXd::Identity(p.J.rows(), p.J.rows()));
    EXPECT_LT(worst.note(relative_difference(t.velocity, s.velocity) * s.velocity.norm() / p.v.norm(), i), 1e-11);
    largest = std::max(largest, relative_difference(t.impulse, s.impulse));
  }
  EXPECT_GT(largest, 0.1);  // the impulse depends on the metric
}

TEST(ImpulsiveConstraint, CountsConstraintsOfVeryDifferentScale) {
  // Masses of 1 and 1e6, each with its own constraint; D scales each constraint by the inverse of the mass that it
  // moves.
  const Eigen::MatrixXd M = Eigen::Vector2d(1, 1e6).asDiagonal(), J = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd D = Eigen::Vector2d(1, 1e-6).asDiagonal();
  const ImpulsiveSolution s = solve_impulsive_constraint(M, J, Eigen::Vector2d(1, 1), D);
  EXPECT_EQ(s.rank, 2);
  EXPECT_NEAR(s.impulse[0], -1, 1e-15);
  EXPECT_NEAR(s.impulse[1], -1e6, 1e-9);
}

TEST(ImpulsiveConstraint, NoRowsChangeNothing) {
  const Eigen::VectorXd v = Eigen::Vector3d(1, 2, 3);
  const ImpulsiveSolution s =
      solve_impulsive_constraint(Eigen::MatrixXd::Identity(3, 3), Eigen::MatrixXd(0, 3), v, Eigen::MatrixXd(0, 0));
  EXPECT_EQ(s.velocity, v);
  EXPECT_EQ(s.impulse.size(), 0);
  EXPECT_EQ(s.rank, 0);
  EXPECT_EQ(s.null_space.cols(), 0);
}

TEST(ImpulsiveConstraint, RejectsInvalidProblems) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(2, 2), J = Eigen::MatrixXd::Identity(1, 2),
                        D = Eigen::MatrixXd::Identity(1, 1);
  const Eigen::VectorXd v = Eigen::VectorXd::Ones(2);
  const auto message = [](auto&& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message([&] { solve_impulsive_constraint(one, J, v, one); }),
            "solve_impulsive_constraint: sizes of M, J, v and D do not match");
  EXPECT_EQ(message([&] { solve_impulsive_constraint(-one, J, v, D); }),
            "solve_impulsive_constraint: M is not positive definite");
  EXPECT_EQ(message([&] { solve_impulsive_constraint(one, J, v, -D); }),
            "solve_impulsive_constraint: D is not positive definite");
  EXPECT_EQ(message([&] { solve_impulsive_constraint(one, J, v, D); }), "accepted");
}

}  // namespace impulsive_constraint_test
}  // namespace grapnel::testing
