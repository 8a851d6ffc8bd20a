// The mass matrix factored along branches against a dense solution.
#include "grapnel/dynamics/branch_cholesky.hpp"

#include <gtest/gtest.h>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace branch_cholesky_test {

TEST(BranchCholesky, SolvesWithTheMassMatrixOfRandomRobots) {
  Worst worst("against a dense solution, over the largest number");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.free_root = i % 4 != 3;
    options.spherical_joints = i % 3 == 0;
    options.targets = i % 3;
    const Model model = random_model(options, random);
    if (model.velocities() == 0) continue;
    const Eigen::MatrixXd M = mass_matrix(model, random_state(model, random));
    const Eigen::MatrixXd B = Eigen::MatrixXd::Identity(model.velocities(), std::min(model.velocities(), 1 + i % 19));
    BranchCholesky inertia(model);
    inertia.factor(M);
    Eigen::MatrixXd X;
    inertia.solve(B, X);
    const Eigen::MatrixXd dense = cholesky_solution(Cholesky(M), B);
    worst.note((X - dense).cwiseAbs().maxCoeff() / dense.cwiseAbs().maxCoeff(), i);
  }
  EXPECT_LT(worst.value(), 1e-10);  // measured 3.8e-13
}

}  // namespace branch_cholesky_test
}  // namespace grapnel::testing
