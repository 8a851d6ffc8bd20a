/// Impulses inside the robot: every joint's, and the ground's under a fixed base.

#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "impact/impact_case.hpp"
#include "impact/maximal_coordinates.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace reactions_test {

std::vector<Impulsed> reactions(const ImpactCase& c, const ImpactSolution& s) {
  std::vector<ExternalImpulse> external;
  for (std::size_t i = 0; i < c.grasps.size(); ++i) {
    external.push_back({c.grasps[i].robot_body, c.grasps[i].p_WC, s.contacts[i].P_WC});
    external.push_back({c.grasps[i].target_body, c.grasps[i].p_WC, -s.contacts[i].P_WC});
  }
  return joint_impulses(c.model, c.state, with_velocity(c.state, s.velocity), external);
}

double size(const Impulsed& P) { return norm(P.linear) + norm(P.angular); }
double largest(const std::vector<Impulsed>& impulses) {
  double result = 0;
  for (const Impulsed& P : impulses) result = std::max(result, size(P));
  return result;
}

// The joints' own multipliers decide in maximal coordinates; here they come from momentum differences.
TEST(JointImpulses, AreTheMultipliersOfMaximalCoordinates) {
  Worst worst("joint impulses against multipliers");
  int compared = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    if (s.rank < s.rows) continue;
    const std::vector<Impulsed> own = reactions(c, s);
    const MaximalSolution m = maximal_impact(c.model, c.state, c.grasps);
    const double scale = largest(m.joint) + largest(m.contact);
    for (std::size_t b = 0; b < own.size(); ++b) EXPECT_LT(worst.note(size(own[b] - m.joint[b]) / scale, i), 1e-8);
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

TEST(JointImpulses, FreeJointTransmitsOnlyRotorImpulse) {
  Worst worst("driving component of free joints, rotors' part taken off"), roots("impulse through free roots");
  int rotors = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const std::vector<Impulsed> own = reactions(c, s);
    const Kinematics k = forward_kinematics(c.model, c.state);
    double scale = largest(own);
    for (const ContactImpulse& P : s.contacts) scale = std::max(scale, size(P.P_WC));
    for (std::size_t b = 0; b < own.size(); ++b) {
      const Body& body = c.model.bodies()[b];
      const JointDescription& joint = body.description.joint;
      if (joint.type == JointType::free) {
        EXPECT_LT(roots.note(size(own[b]) / scale, i), 1e-10);
      }
      if (joint.type == JointType::spherical) {
        EXPECT_LT(worst.note(norm(own[b].angular) / scale, i), 1e-10);
      }
      if (velocity_count(joint.type) != 1) continue;
      const Vector3d axis = k.X_WB[b].R * joint.axis;
      const double along = dot(axis, joint.type == JointType::prismatic ? own[b].linear : own[b].angular);
      const double rotor = joint.reflected_inertia() * (s.velocity[body.v] - c.state.v[body.v]);
      rotors += std::abs(rotor) > 1e-3 * scale;
      EXPECT_LT(worst.note(std::abs(along + rotor) / scale, i), 1e-9);
    }
  }
  EXPECT_GT(rotors, 20);  // some matter
}

TEST(JointImpulses, GroundImpulseOfFixedBase) {
  Worst worst("momentum change against the ground's impulse");
  int fixed = 0;
  for (int i = 4; i < kImpacts; i += 5) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const int base = c.model.body_index("b0");
    ASSERT_EQ(c.model.bodies()[base].description.joint.type, JointType::fixed);
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const Vector3d p = forward_kinematics(c.model, c.state).X_WB[base].p;
    const Momentumd change =
        momentum_about(c.model, forward_kinematics(c.model, with_velocity(c.state, s.velocity)), p) -
        momentum_about(c.model, forward_kinematics(c.model, c.state), p);
    const std::vector<Impulsed> own = reactions(c, s);
    const Impulsed ground = own[base];
    ASSERT_GT(size(ground), 1e-3);
    const double scale = largest(own);
    EXPECT_LT(worst.note(norm(change.linear - ground.linear) / scale, i), 1e-10);
    EXPECT_LT(worst.note(norm(change.angular - ground.angular) / scale, i), 1e-10);
    ++fixed;
  }
  EXPECT_EQ(fixed, kImpacts / 5);
}

}  // namespace reactions_test
}  // namespace grapnel::testing
