/// What an impact's checks are relative to: the trees that take part.

#include <gtest/gtest.h>

#include "grapnel/impact/plastic_impact.hpp"
#include "impact/impact_case.hpp"

namespace grapnel::testing {
namespace impact_checks_test {

TEST(ImpactChecks, ParticipationByTree) {
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    if (!c.model.has_free_root(0)) continue;  // what holds a fixed base moves nothing of its arms
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

// Two bodies of 2 kg that meet, one of 1e12 kg that passes by: an error of the two is theirs.
TEST(ImpactChecks, RelativeToParticipatingBodies) {
  const Eigen::Vector3d mass{2, 2, 1e12}, part{1, 1, 0}, before{3, -1, 7}, right{1, 1, 7};
  const Eigen::MatrixXd M = mass.asDiagonal();
  const Eigen::Vector3d P{-4, 4, 0};
  const double work = 0.5 * P.dot(before + right);
  const ImpactChecks good = impact_checks(M, Cholesky(M), part, before, right, P, work);
  EXPECT_EQ(good.energy_identity_residual, 0);
  EXPECT_EQ(good.generalized_momentum_residual, 0);
  EXPECT_DOUBLE_EQ(good.kinetic_energy_before, 10 + 24.5e12);

  const Eigen::Vector3d wrong{1, 1.1, 7};  // 0.2 N s too much, 0.21 J too much of 10 J
  const ImpactChecks bad = impact_checks(M, Cholesky(M), part, before, wrong, P, work);
  EXPECT_NEAR(bad.energy_identity_residual, 0.021, 1e-15);
  EXPECT_NEAR(bad.generalized_momentum_residual, std::sqrt(0.2 * 0.2 / 2 / 20), 1e-15);

  // A bystander that changes its motion is an error of this impact.
  const Eigen::Vector3d moved{1, 1, 7.001};
  EXPECT_GT(impact_checks(M, Cholesky(M), part, before, moved, P, work).generalized_momentum_residual, 1);
}

TEST(ImpactChecks, ZeroScale) {
  const Eigen::MatrixXd M = Eigen::Vector2d{1, 1}.asDiagonal();
  const Eigen::Vector2d rest{0, 0}, none{0, 0}, part{1, 1}, moves{0, 1};
  EXPECT_EQ(impact_checks(M, Cholesky(M), part, rest, rest, none, 0).energy_identity_residual, 0);
  EXPECT_EQ(impact_checks(M, Cholesky(M), part, rest, rest, none, 0).generalized_momentum_residual, 0);
  EXPECT_NEAR(impact_checks(M, Cholesky(M), part, rest, moves, none, 0).generalized_momentum_residual, 1, 1e-15);
  EXPECT_TRUE(std::isinf(impact_checks(M, Cholesky(M), rest, rest, moves, none, 0).generalized_momentum_residual));
}

}  // namespace impact_checks_test
}  // namespace grapnel::testing
