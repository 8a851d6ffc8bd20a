/// The thesis's formulas: limit in which they are exact, their error, and cases in which they do not apply.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"

namespace grapnel::testing {
namespace published_impact_test {

Momentumd momentum_error(const ReferenceImpact& r, const ImpactSolution& solution) {
  State after = r.state;
  after.v = solution.velocity;
  return momentum_about(r.model, forward_kinematics(r.model, after), Vector3d::zero()) -
         momentum_about(r.model, forward_kinematics(r.model, r.state), Vector3d::zero());
}

ImpactSolution published(const ReferenceImpact& r) {
  return published_impact(r.model, r.state, r.model.body_index("base"), r.grasps);
}

// The formulas omit the momentum that the robot receives: the momentum error equals the impulses.
TEST(PublishedImpact, MomentumErrorIsTheImpulseItDrops) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  ReferenceImpact one_sided = r;  // in case 1 the two impulses nearly cancel
  one_sided.grasps.pop_back();
  for (const ReferenceImpact& c : {r, one_sided}) {
    const ImpactSolution p = published(c);
    ASSERT_EQ(p.message, "");
    Momentumd dropped = Momentumd::zero();
    for (std::size_t i = 0; i < c.grasps.size(); ++i) {
      const Impulsed about_origin = shift(p.contacts[i].P_WC, -c.grasps[i].p_WC);
      dropped += Momentumd{about_origin.angular, about_origin.linear};
    }
    const Momentumd error = momentum_error(c, p);
    EXPECT_LT(norm(error.linear + dropped.linear), 1e-13);    // measured 1.3e-15
    EXPECT_LT(norm(error.angular + dropped.angular), 1e-13);  // measured 1e-14
    EXPECT_GT(norm(error.angular), 0.02);                     // measured 0.022
  }
  EXPECT_GT(norm(momentum_error(one_sided, published(one_sided)).linear), 0.1);  // measured 0.12
}

// A base of infinite mass does not change its motion: in this limit the formulas are exact, and the error is
// proportional to 1/mass.
TEST(PublishedImpact, ConvergesForHeavyBase) {
  const auto error = [](double factor) {
    const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1, factor);
    const ImpactSolution p = published(r);
    const ImpactSolution s = plastic_impact(r.model, r.state, r.grasps);
    double largest = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const Impulsed d = p.contacts[i].P_WC - s.contacts[i].P_WC;
      largest = std::max(largest, norm(d.linear) + norm(d.angular));
    }
    return largest;
  };
  EXPECT_GT(error(1), 1e-3);  // measured 0.0021
  const double e3 = error(1e3), e4 = error(1e4);
  EXPECT_LT(e3, 1e-5);
  EXPECT_NEAR(e3 / e4, 10, 0.2);
}

TEST(PublishedImpact, ReportsWhereUndefined) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  const int base = r.model.body_index("base");
  EXPECT_EQ(published_impact(r.model, r.state, base, {}).message, "no grasps");
  std::vector<Grasp> grasps = r.grasps;
  grasps[1].model = GraspModel::hinge;
  EXPECT_EQ(published_impact(r.model, r.state, base, grasps).message, "the formulas are for rigid grasps");
  // A single grasp on the first link of an arm.
  grasps = r.grasps;
  grasps.pop_back();
  grasps[0].robot_body = r.model.body_index("arm-1-link-1");
  State state = r.state;
  const ImpactSolution p = published_impact(r.model, state, base, grasps);
  EXPECT_EQ(p.message, "");  // I dtheta = -C^T (...) is always in the range of J^T

  const ImpactCase fixed = random_impact(4);
  EXPECT_EQ(published_impact(fixed.model, fixed.state, fixed.model.body_index("b0"), fixed.grasps).message,
            "the base is fixed");
}

// Two arms on one target, with J_t^-1 as a pseudo-inverse: the formulas conserve generalized momentum (3.6), but their
// velocities violate the closed loop.
TEST(PublishedImpact, ViolatesLoopOfSharedTarget) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  std::vector<Grasp> grasps = r.grasps;
  grasps[1].target_body = grasps[0].target_body;
  const ImpactSolution p = published_impact(r.model, r.state, r.model.body_index("base"), grasps);
  ASSERT_EQ(p.message, "");
  State after = r.state;
  after.v = p.velocity;
  const Eigen::MatrixXd J = grasp_jacobian(r.model, forward_kinematics(r.model, r.state), grasps);
  const Eigen::VectorXd u = J * Eigen::Map<const Eigen::VectorXd>(after.v.data(), J.cols());
  EXPECT_GT(u.norm(), 1e-3);
  const ImpactSolution right = plastic_impact(r.model, r.state, grasps);
  const Eigen::VectorXd none = J * Eigen::Map<const Eigen::VectorXd>(right.velocity.data(), J.cols());
  EXPECT_LT(none.norm(), 1e-14);
}

}  // namespace published_impact_test
}  // namespace grapnel::testing
