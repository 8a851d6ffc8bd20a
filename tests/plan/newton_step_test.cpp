/// Minimum-norm steps within bounds.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "grapnel/plan/shooting.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace newton_step_test {

constexpr double kNone = std::numeric_limits<double>::infinity();

TEST(NewtonStep, IsTheMinimumNormSolution) {
  Eigen::MatrixXd J(2, 3);
  J << 1, 2, 0.5, -1, 0.3, 2;
  const Eigen::Vector2d e(0.3, -0.7);
  const std::vector<double> x(3, 0.0), lower(3, -kNone), upper(3, kNone);
  const NewtonStep step = minimum_norm_step(J, e, x, lower, upper, 0);
  EXPECT_LT((e + J * step.d).norm(), 1e-15);
  const Eigen::VectorXd expected = -J.transpose() * (J * J.transpose()).inverse() * e;
  EXPECT_LT((step.d - expected).norm(), 1e-15);
  EXPECT_FALSE(step.filtered);
}

TEST(NewtonStep, RespectsABound) {
  Eigen::MatrixXd J(1, 2);
  J << 1, 1;
  const Eigen::VectorXd e = Eigen::VectorXd::Constant(1, -2.0);
  const NewtonStep step = minimum_norm_step(J, e, {0, 0}, {-kNone, -kNone}, {0.25, kNone}, 0);
  EXPECT_DOUBLE_EQ(step.d[0], 0.25);
  EXPECT_NEAR(step.d[1], 1.75, 1e-15);
  EXPECT_EQ(step.at_bound, std::vector<int>{0});
}

TEST(NewtonStep, StopsIfAllVariablesAreBound) {
  Eigen::MatrixXd J(1, 2);
  J << 1, 1;
  const Eigen::VectorXd e = Eigen::VectorXd::Constant(1, -2.0);
  const NewtonStep step = minimum_norm_step(J, e, {0, 0}, {-1, -1}, {0.25, 0.5}, 0);
  EXPECT_DOUBLE_EQ(step.d[0], 0.25);
  EXPECT_DOUBLE_EQ(step.d[1], 0.5);
}

TEST(NewtonStep, DampsSmallSingularValuesAndSkipsStructuralZeros) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, 3);
  J(0, 0) = 1, J(1, 1) = 1e-4;  // the third row and column are zero
  const Eigen::Vector3d e(-1, -1, -1);
  const std::vector<double> x(3, 0.0), lower(3, -kNone), upper(3, kNone);
  const NewtonStep step = minimum_norm_step(J, e, x, lower, upper, 1e-2);
  EXPECT_NEAR(step.d[0], 1, 1e-15);
  EXPECT_NEAR(step.d[1], 1e-4 / (1e-8 + 0.0099 * 0.0099), 1e-12);
  EXPECT_EQ(step.d[2], 0);
  EXPECT_TRUE(step.filtered);
  EXPECT_DOUBLE_EQ(smallest_singular_value(J), 1e-4);
}

// Damping by the eigenvalues of J J^T: against the singular values of J, some of them small or zero.
TEST(NewtonStep, DampingAgreesWithSingularValues) {
  testing::Worst worst("damped step against that by singular values, relative");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(testing::seed_note(i));
    testing::Random random(i);
    const int rows = 2 + i % 6, columns = 3 + i % 7;
    const double damping = 0.02;
    const auto filled = [&](Eigen::Index n, Eigen::Index m) {
      return Eigen::MatrixXd::NullaryExpr(n, m, [&] { return random.uniform(-1, 1); }).eval();
    };
    const Eigen::JacobiSVD<Eigen::MatrixXd> drawn(filled(rows, columns), Eigen::ComputeThinU | Eigen::ComputeThinV);
    Eigen::VectorXd sigma = drawn.singularValues();
    sigma[sigma.size() - 1] = i % 3 == 0 ? 0 : random.uniform(1e-4, 2 * damping);
    const Eigen::MatrixXd J = drawn.matrixU() * sigma.asDiagonal() * drawn.matrixV().transpose();
    const Eigen::VectorXd e = filled(rows, 1);
    Eigen::VectorXd y = drawn.matrixU().transpose() * -e;
    for (Eigen::Index k = 0; k < sigma.size(); ++k) {
      const double lack = std::max(0.0, damping - sigma[k]);
      y[k] *= sigma[k] / (sigma[k] * sigma[k] + lack * lack);
    }
    const Eigen::VectorXd expected = drawn.matrixV() * y;
    const std::vector<double> x(static_cast<std::size_t>(columns), 0.0), lower(x.size(), -kNone),
        upper(x.size(), kNone);
    const NewtonStep step = minimum_norm_step(J, e, x, lower, upper, damping);
    EXPECT_LT(worst.note((step.d - expected).norm() / (1 + expected.norm()), i), 1e-8);  // measured 6e-11
  }
}

}  // namespace newton_step_test
}  // namespace grapnel
