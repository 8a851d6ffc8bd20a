/// Reference values of thesis-facts, from two models written before this project, and closed forms for two bodies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/published_impact.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "oracle/two_body_impact.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace reference_impulses_test {

// Half a unit of the last given digit, with a margin for the configuration's four digits.
constexpr double kDigits = 0.6e-4;

struct Planar {
  double fx, fy, mz;
};
void expect_contacts(const std::vector<ContactImpulse>& contacts, const Planar (&expected)[2]) {
  ASSERT_EQ(contacts.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    SCOPED_TRACE(i);
    const Impulsed& P = contacts[i].P_WC;
    EXPECT_NEAR(P.linear[0], expected[i].fx, kDigits);
    EXPECT_NEAR(P.linear[1], expected[i].fy, kDigits);
    EXPECT_NEAR(P.angular[2], expected[i].mz, kDigits);
    EXPECT_LT(std::abs(P.linear[2]) + std::abs(P.angular[0]) + std::abs(P.angular[1]), 1e-14);  // measured 9.4e-17
  }
}

TEST(ReferenceImpulses, ConfigurationIsTheStatedOne) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  const Kinematics k = forward_kinematics(r.model, r.state);
  const Twistd V = frame_twist(r.model, k, r.model.frame_index("tip-1"));
  EXPECT_LT(norm(V.linear - Vector3d{-0.1, 0, 0}) + norm(V.angular), 1e-14);  // measured 4.2e-17
  // thesis-facts: with ideal tracking the tips end here.
  const Vector3d p1 = frame_pose(r.model, k, r.model.frame_index("tip-1")).p;
  const Vector3d p2 = frame_pose(r.model, k, r.model.frame_index("tip-2")).p;
  EXPECT_NEAR(p1[0], 1.9932, 1e-4);
  EXPECT_NEAR(p1[1], -1.4189, 1e-4);
  EXPECT_NEAR(p2[0], -1.9939, 1e-4);
  EXPECT_NEAR(p2[1], 1.4571, 1e-4);
  const int roots[] = {r.model.body_index("base")};
  const Momentumd h = momentum_about(r.model, k, {0, 0, 0}, roots);
  EXPECT_LT(norm(h.angular) + norm(h.linear), 1e-13);
  EXPECT_GT(std::abs(r.state.v[6]), 0.01);  // the base moves
}

TEST(ReferenceImpulses, RigidGrasp) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  const ImpactSolution s = plastic_impact(r.model, r.state, r.grasps);
  expect_contacts(s.contacts, {{0.0441, -0.1091, 0.1374}, {-0.0442, 0.1092, 0.1374}});
  EXPECT_EQ(s.rows, 12);
  EXPECT_EQ(s.rank, 12);
}

TEST(ReferenceImpulses, PointGraspOfPointsThatMoveTogether) {
  const ReferenceImpact r = reference_impact(GraspModel::point, 0.1);
  const ImpactSolution s = plastic_impact(r.model, r.state, r.grasps);
  for (const ContactImpulse& c : s.contacts)
    EXPECT_LT(norm(c.P_WC.linear) + norm(c.P_WC.angular), 1e-14);  // measured 2.3e-16
  EXPECT_GT(s.kinetic_energy_before, 0.1);
}

TEST(ReferenceImpulses, AtRestRigid) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0);
  expect_contacts(plastic_impact(r.model, r.state, r.grasps).contacts,
                  {{-0.1290, -0.0172, 0.1154}, {0.1290, 0.0172, 0.1154}});
}

TEST(ReferenceImpulses, AtRestPoint) {
  const ReferenceImpact r = reference_impact(GraspModel::point, 0);
  expect_contacts(plastic_impact(r.model, r.state, r.grasps).contacts, {{-0.1661, 0.0744, 0}, {0.1661, -0.0745, 0}});
}

TEST(ReferenceImpulses, PublishedFormula) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  const ImpactSolution p = published_impact(r.model, r.state, r.model.body_index("base"), r.grasps);
  ASSERT_EQ(p.message, "");
  expect_contacts(p.contacts, {{0.0440, -0.1111, 0.1374}, {-0.0440, 0.1112, 0.1375}});
}

// Two free bodies in a plane, closed form: general masses, centres of mass off the frames' origins.
TEST(TwoBodies, RigidGraspMatchesClosedForm) {
  Worst worst("impulse and velocities of two planar bodies against the closed form");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    oracle::PlanarBody b[2];
    ModelBuilder builder;
    for (int k = 0; k < 2; ++k) {
      b[k] = {random.log_uniform(0.5, 500),
              random.log_uniform(0.1, 100),
              {random.uniform(-1, 1), random.uniform(-1, 1)},
              {random.uniform(-1, 1), random.uniform(-1, 1)},
              random.uniform(-2, 2)};
      BodyDescription d;
      d.name = d.joint.name = k == 0 ? "base" : "target";
      d.joint.type = JointType::free;
      d.mass = b[k].mass;
      d.com = {random.uniform(-1, 1), random.uniform(-1, 1), 0};
      d.inertia = Symmetric3d::diagonal(b[k].inertia, b[k].inertia, b[k].inertia);
      builder.add(d);
    }
    const Model model = builder.build();
    State state = zero_state(model);
    for (int k = 0; k < 2; ++k) {
      const int body = model.body_index(k == 0 ? "base" : "target");
      const Rotationd R = rotation_about({0, 0, 1}, random.uniform(-3, 3));
      const Vector3d arm = R * model.bodies()[body].description.com;
      set_root_pose(model, body, {R, Vector3d{b[k].com[0], b[k].com[1], 0} - arm}, state);
      set_root_twist(model, body, shift(Twistd{{0, 0, b[k].rate}, {b[k].velocity[0], b[k].velocity[1], 0}}, -arm),
                     state);
    }
    const Eigen::Vector2d c{random.uniform(-2, 2), random.uniform(-2, 2)};
    const Grasp grasp{
        model.body_index("base"), model.body_index("target"), GraspModel::rigid, {c[0], c[1], 0}, {0, 0, 1}};
    const ImpactSolution s = plastic_impact(model, state, {&grasp, 1});
    const oracle::PlanarImpact exact = oracle::rigid_grasp(b[0], b[1], c);
    const Impulsed& P = s.contacts[0].P_WC;
    const double size = exact.impulse.norm() + std::abs(exact.angular_impulse);
    const double error = (Eigen::Vector2d(P.linear[0], P.linear[1]) - exact.impulse).norm() +
                         std::abs(P.angular[2] - exact.angular_impulse);
    EXPECT_LT(worst.note(error / size, i), 1e-11);
    const Kinematics k = forward_kinematics(model, with_velocity(state, s.velocity));
    EXPECT_LT(worst.note(std::abs(k.V_WB[1].angular[2] - exact.rate1) / 2, i), 1e-12);
  }
}  // measured 1e-13

}  // namespace reference_impulses_test
}  // namespace grapnel::testing
