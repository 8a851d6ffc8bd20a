/// Scales of an impact's checks: the trees that take part.

#include <gtest/gtest.h>

#include "grapnel/impact/plastic_impact.hpp"
#include "impact/impact_case.hpp"

namespace grapnel::testing {
namespace impact_checks_test {

TEST(ImpactChecks, ParticipationByTree) {
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    if (!c.model.has_free_root(0)) continue;  // each arm of a fixed base takes part separately
    const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
    const Eigen::VectorXd part = taking_part(c.model, J);
    for (const Body& body : c.model.bodies()) {
      bool grasped = false;
      for (const Grasp& g : c.grasps) {
        for (int b : {g.robot_body, g.target_body}) grasped = grasped || c.model.bodies()[b].root == body.root;
      }
      for (int k = 0; k < velocity_count(body.description.joint.type); ++k)
        EXPECT_EQ(part[body.v + k], grasped ? 1 : 0);
    }
    EXPECT_TRUE(taking_part(c.model, Eigen::MatrixXd(0, c.model.velocities())).isZero(0));
  }
}

// Two bodies of 2 kg collide, a body of 1e12 kg does not take part: errors are relative to the two bodies.
TEST(ImpactChecks, RelativeToParticipatingBodies) {
  const Eigen::Vector3d mass{2, 2, 1e12}, part{1, 1, 0}, before{3, -1, 7}, right{1, 1, 7};
  const Eigen::MatrixXd M = mass.asDiagonal();
  const Eigen::Vector3d P{-4, 4, 0};
  const double work = 0.5 * P.dot(before + right);
  const ImpactChecks good = impact_checks(M, Cholesky(M), part, before, right, P, work);
  EXPECT_EQ(good.energy_identity_residual, 0);
  EXPECT_EQ(good.generalized_momentum_residual, 0);
  EXPECT_DOUBLE_EQ(good.kinetic_energy_before, 10 + 24.5e12);

  const Eigen::Vector3d wrong{1, 1.1, 7};  // errors of 0.2 N s, and of 0.21 J relative to 10 J
  const ImpactChecks bad = impact_checks(M, Cholesky(M), part, before, wrong, P, work);
  EXPECT_NEAR(bad.energy_identity_residual, 0.021, 1e-15);
  EXPECT_NEAR(bad.generalized_momentum_residual, std::sqrt(0.2 * 0.2 / 2 / 20), 1e-15);

  // A change of motion of the third body is an error of this impact.
  const Eigen::Vector3d moved{1, 1, 7.001};
  EXPECT_GT(impact_checks(M, Cholesky(M), part, before, moved, P, work).generalized_momentum_residual, 1);
}

TEST(ImpactChecks, ZeroScale) {
  const Eigen::MatrixXd M = Eigen::Vector2d{1, 1}.asDiagonal();
  const Eigen::Vector2d rest{0, 0}, none{0, 0}, part{1, 1}, moves{0, 1};
  EXPECT_EQ(impact_checks(M, Cholesky(M), part, rest, rest, none, 0).energy_identity_residual, 0);
  EXPECT_EQ(impact_checks(M, Cholesky(M), part, rest, rest, none, 0).generalized_momentum_residual, 0);
  EXPECT_NEAR(impact_checks(M, Cholesky(M), part, rest, moves, none, 0).generalized_momentum_residual, 1, 1e-15);
  EXPECT_GT(impact_checks(M, Cholesky(M), rest, rest, moves, none, 0).generalized_momentum_residual, 1e3);
}

// What takes part is at rest, and another body moves by a rounding error more.
TEST(ImpactChecks, RoundingOfOthersIsNoError) {
  const Eigen::MatrixXd M = Eigen::Vector2d{1, 1}.asDiagonal();
  const Eigen::Vector2d none{0, 0}, part{1, 0}, before{0, 1};
  const auto residual = [&](double change) {
    const Eigen::Vector2d after{0, 1 + change};
    return impact_checks(M, Cholesky(M), part, before, after, none, 0).generalized_momentum_residual;
  };
  EXPECT_LT(residual(2e-16), 1e-11);
  EXPECT_GT(residual(2e-14), 1e-10);
}

}  // namespace impact_checks_test
}  // namespace grapnel::testing
