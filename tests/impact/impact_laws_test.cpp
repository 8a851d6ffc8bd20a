/// The table of impact laws: its rows, and identities that every law satisfies through the common interface.

#include <gtest/gtest.h>

#include "grapnel/impact/impact_law.hpp"
#include "impact/contact_case.hpp"
#include "impact/impact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impact_laws_test {

using Law = ImpactSetup::Law;

TEST(ImpactLaws, TableNamesEveryValueInOrder) {
  for (std::size_t i = 0; i < impact_laws().size(); ++i) {
    const ImpactLaw& row = impact_laws()[i];
    EXPECT_EQ(static_cast<std::size_t>(row.law), i) << row.name;
    EXPECT_EQ(&impact_law(row.law), &row);
    EXPECT_EQ(name_of(row.law), row.name);
    EXPECT_EQ(value_named<Law>(row.name), row.law);
    EXPECT_TRUE(row.of_grasps || row.of_contacts) << row.name;
    for (std::string_view key : row.keys)
      EXPECT_TRUE(key.empty() || field_named(type_of<ImpactSetup>(), key)) << row.name << ": " << key;
  }
}

// M (v+ - v-) = J^T P, and no law adds energy.
TEST(ImpactLaws, GraspsConserveGeneralizedMomentum) {
  Worst momentum("|M dv - J^T P| over |M v|");
  for (const ImpactLaw& law : impact_laws()) {
    if (!law.of_grasps || law.in_time || law.published) continue;
    for (int i = 0; i < 60; ++i) {
      SCOPED_TRACE(std::string(law.name) + ": " + seed_note(i));
      const ImpactCase c = random_impact(i);
      ImpactSetup setup;
      setup.law = law.law, setup.restitution = setup.angular_restitution = 0.4;
      const ImpactSolution s = law.solve({.model = c.model, .state = c.state, .setup = setup, .grasps = c.grasps});
      ASSERT_EQ(s.status, ImpactSolution::Status::solved) << s.message;
      ASSERT_EQ(s.contacts.size(), c.grasps.size());
      const Eigen::MatrixXd M = mass_matrix(c.model, c.state);
      const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps);
      const Eigen::VectorXd change = M * (eigen(s.velocity) - eigen(c.state.v));
      const double off = (change - J.transpose() * stacked_impulse(c, s)).norm() / (M * eigen(c.state.v)).norm();
      EXPECT_LT(momentum.note(off, i), 1e-9);
      EXPECT_LT(s.kinetic_energy_after, s.kinetic_energy_before * (1 + 1e-12));
    }
  }
}

// The interface passes normals, coefficients and grasps that hold; contacts follow the grasps in the solution.
TEST(ImpactLaws, ContactsEqualContactImpact) {
  const ContactCase c = random_contacts(3, 2);
  std::vector<Grasp> grasps;
  std::vector<Vector3d> normals;
  for (const ContactPoint& p : c.contacts) {
    grasps.push_back({p.robot_body, p.target_body, GraspModel::point, p.p_WC, {0, 0, 1}});
    normals.push_back(p.n_W);
  }
  for (Law law : {Law::restitution, Law::friction}) {
    ImpactSetup setup;
    setup.law = law, setup.restitution = 0.5, setup.friction = 0.3;
    std::vector<ContactPoint> points = c.contacts;
    for (ContactPoint& p : points) p.restitution = 0.5, p.friction = law == Law::friction ? 0.3 : 0;
    const ImpactSolution direct = contact_impact(c.model, c.state, points, setup.hypothesis);
    const ImpactSolution s = impact_law(law).solve(
        {.model = c.model, .state = c.state, .setup = setup, .grasps = grasps, .normals = normals});
    ASSERT_EQ(s.status, ImpactSolution::Status::solved) << s.message;
    EXPECT_EQ(s.velocity, direct.velocity);
    EXPECT_GT(s.points[0].normal, 0);
  }
}

}  // namespace impact_laws_test
}  // namespace grapnel::testing
