/// Contacts with closed grasps and held rates.

#include <gtest/gtest.h>

#include <cmath>

#include "impact/contact_case.hpp"

namespace grapnel::testing {
namespace contact_grasps_test {

// Two bodies connected by a rigid grasp respond to an impact like one composite body.
TEST(ContactGrasps, ClosedGraspFormsCompositeBody) {
  for (RestitutionHypothesis h : kHypotheses) {
    const Lump striker{"striker", 1.5, {0.2, 0.3, 0.1}, {0.4, 0.1, 0.6}, {{0.3, -0.2, 0.1}, {0.2, 0.1, -1}}};
    ContactCase two =
        lumps({striker, {"left", 2, {0.3, 0.4, 0.5}, {-0.5, 0, -0.5}}, {"right", 2, {0.3, 0.4, 0.5}, {0.5, 0, -0.5}}});
    two.contacts = {{0, 2, {0.3, 0.2, 0}, {0, 0, 1}, 0.5, 0.3, 1}};
    const Grasp grasp{1, 2, GraspModel::rigid, {0, 0, -0.5}, {0, 0, 1}};
    const ImpactSolution held = contact_impact(two.model, two.state, two.contacts, h, {&grasp, 1});
    // Parallel-axis theorem: 2 kg at 0.5 m on either side along x.
    ContactCase one = lumps({striker, {"both", 4, {0.6, 0.8 + 1, 1.0 + 1}, {0, 0, -0.5}}});
    one.contacts = {{0, 1, {0.3, 0.2, 0}, {0, 0, 1}, 0.5, 0.3, 1}};
    const ImpactSolution composite = one.solve(h);
    ASSERT_EQ(held.status, ImpactSolution::Status::solved) << held.message;
    EXPECT_NEAR(norm(held.contacts[1].P_WC.linear - composite.contacts[0].P_WC.linear), 0, 1e-11);
    EXPECT_NEAR(held.kinetic_energy_after, composite.kinetic_energy_after, 1e-11);
  }
}

// With increasing rotor inertia a joint converges to a held rate: the error is proportional to 1/inertia.
TEST(ContactGrasps, LargeRotorBecomesAHeldRate) {
  const auto arm = [](double rotor) {
    ModelBuilder builder;
    BodyDescription base, link, ball;
    base.name = "base", base.joint.name = "base joint", base.joint.type = JointType::free;
    base.mass = 5, base.inertia = Symmetric3d::diagonal(0.5, 0.6, 0.7);
    link.name = "link", link.parent = "base", link.joint.name = "elbow", link.joint.type = JointType::revolute;
    link.mass = 1, link.com = {0.3, 0, 0}, link.inertia = Symmetric3d::diagonal(0.01, 0.04, 0.05);
    link.joint.rotor_inertia = rotor;
    ball.name = "ball", ball.joint.name = "ball joint", ball.joint.type = JointType::free;
    ball.mass = 2, ball.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
    builder.add(base), builder.add(link), builder.add(ball);
    ContactCase c{builder.build(), {}, {}};
    c.state = zero_state(c.model);
    const int b = c.model.body_index("ball"), l = c.model.body_index("link");
    set_root_pose(c.model, b, {Rotationd::identity(), {0.6, -0.2, 0.1}}, c.state);
    set_root_twist(c.model, b, {{0.2, 0.1, -0.3}, {0.2, 1, -0.1}}, c.state);
    c.state.v[static_cast<std::size_t>(c.model.bodies()[static_cast<std::size_t>(l)].v)] = 0.4;
    c.contacts = {{l, b, {0.6, 0, 0}, {0, 1, 0}, 0.5, 0.4, 1}};
    return c;
  };
  for (RestitutionHypothesis h : kHypotheses) {
    const ContactCase c = arm(0);
    const int v = c.model.bodies()[static_cast<std::size_t>(c.model.body_index("link"))].v;
    const HeldRate rate{v, c.state.v[static_cast<std::size_t>(v)]};
    const ImpactSolution held = contact_impact(c.model, c.state, c.contacts, h, {}, {&rate, 1});
    ASSERT_EQ(held.status, ImpactSolution::Status::solved) << held.message;
    EXPECT_EQ(held.velocity[static_cast<std::size_t>(v)], rate.after);
    double last = 0;
    for (double rotor : {1e3, 1e4, 1e5}) {
      const ImpactSolution s = arm(rotor).solve(h);
      const double error = norm(s.contacts[0].P_WC.linear - held.contacts[0].P_WC.linear) / held.points[0].normal;
      if (last > 0) {
        EXPECT_NEAR(std::log10(last / error), 1, 0.01);
      }
      last = error;
    }
    EXPECT_GT(last, 1e-9);
  }
}

}  // namespace contact_grasps_test
}  // namespace grapnel::testing
