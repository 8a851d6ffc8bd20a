/// Flexible bodies in lanes: springs and dampers at joints, and massless segments between them.

#include <gtest/gtest.h>

#include <cmath>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "lanes/lane_phases.hpp"

namespace grapnel::testing {
namespace springs_test {

// A free base with an arm of two links with bending and torsion, the first driven through an elastic gear, and a
// target; every case has different stiffnesses and masses.
std::vector<Phase> flexible_phases(int index, int count, JointControl control, double damping) {
  Random random(index);
  std::vector<Phase> phases;
  for (int i = 0; i < count; ++i) {
    RobotSetup robot = only_base(30 * random.uniform(0.8, 1.2), 5);
    BodyDescription first = slender_link("first", "base", JointType::revolute, 2, 3 * random.uniform(0.8, 1.2),
                                         40 * random.uniform(0.5, 2), 1);
    first.joint.rotor_inertia = 0.01, first.joint.gear_ratio = 10;
    first.joint.elasticity = JointElasticity{200 * random.uniform(0.5, 2), 0};
    first.X_PF.p = {0.5, 0, 0.2};
    first.beam->bending_stiffness_y = 60, first.beam->torsional_stiffness = 20;
    first.beam->damping_ratio = damping;
    first.inertia.xx = 0.05, first.inertia.yy += 0.05, first.inertia.zz += 0.05;
    BodyDescription second = slender_link("second", "first", JointType::revolute, 1, 2, 30, 1);
    second.X_PF.p = {2, 0, 0}, second.joint.axis = {0, 1, 0};
    second.joint.friction.viscous = 0.1;
    robot.bodies.insert(robot.bodies.end(), {first, second});
    ModelBuilder builder(model_of(robot));
    BodyDescription target;
    target.name = "target", target.joint.name = "target", target.joint.type = JointType::free;
    target.mass = 5, target.inertia = Symmetric3d::diagonal(0.5, 0.6, 0.7);
    builder.add(target);
    Phase p{builder.build(), {}, {}, 1, 2};
    p.start = random_state(p.model, random, 0.1);
    for (const int body : p.model.springs()) {  // large deflections would be chaotic
      const Body& b = p.model.bodies()[static_cast<std::size_t>(body)];
      p.start.q[static_cast<std::size_t>(b.q)] = random.uniform(-0.01, 0.01);
      p.start.v[static_cast<std::size_t>(b.v)] = random.uniform(-0.05, 0.05);
    }
    p.setup.drives = random_drives(p.model, p.start, control, 1.3, random, 1);
    for (std::size_t j = 0; j < p.setup.drives.size(); ++j) {
      if (p.model.bodies()[static_cast<std::size_t>(p.model.joints()[j])].description.joint.spring)
        p.setup.drives[j] = JointDrive{};
      else if (control == JointControl::prescribed)
        std::get<JointPath>(p.setup.drives[j].trajectory.pieces[0].shape).end_rate = 0;
    }
    phases.push_back(std::move(p));
  }
  return phases;
}

TEST(LaneSprings, FreeJointsAgree) { expect_alike("springs", flexible_phases(1, 5, JointControl::free, 0), 1e-9); }

TEST(LaneSprings, DampersAgree) { expect_alike("dampers", flexible_phases(2, 5, JointControl::free, 0.02), 1e-9); }

TEST(LaneSprings, DrivesAgree) {
  expect_alike("pd", flexible_phases(3, 5, JointControl::pd, 0.01), 1e-9);
  expect_alike("prescribed", flexible_phases(4, 5, JointControl::prescribed, 0.01), 1e-9);
  expect_alike("computed torque", flexible_phases(5, 5, JointControl::computed_torque, 0.01), 1e-9);
}

TEST(LaneSprings, BitsDependOnTheCaseAlone) {
  expect_bits_of_the_case_alone(flexible_phases(6, 13, JointControl::pd, 0.01));
}

// Damper work is integrated for one tree only.
TEST(LaneSprings, TargetDampersAreNotSupported) {
  Phase p = flexible_phases(7, 1, JointControl::free, 0.01)[0];
  EXPECT_EQ(lane_obstacle(p.model, p.setup, {}), "");
  ModelBuilder builder(p.model);
  BodyDescription panel;
  panel.name = "panel", panel.parent = "target", panel.joint.name = "hinge", panel.joint.type = JointType::revolute;
  panel.joint.spring = JointSpring{1, 0.1, 0};
  panel.mass = 1, panel.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
  builder.add(panel);
  EXPECT_EQ(lane_obstacle(builder.build(), {}, {}), "dampers outside the robot");
}

}  // namespace springs_test
}  // namespace grapnel::testing
