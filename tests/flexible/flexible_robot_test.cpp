/// Conversion of a flexible robot: masses, shapes, positions; and rejected input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel::testing {
namespace flexible_robot_test {

using ::testing::HasSubstr;

// A link of 12 kg, of which the beam has 6 from (0.1, 0.2, 0) on along y.
RobotSetup with_link() {
  RobotSetup robot = only_base(100, 20);
  BodyDescription link;
  link.name = "arm", link.parent = "base";
  link.joint.name = "shoulder", link.joint.type = JointType::revolute;
  link.X_PF = {rotation_about({1, 0, 0}, 0.3), {0.5, 0.1, 0}};
  link.mass = 12, link.com = {0.2, 0.9, 0.1};
  link.inertia = {5, 1.5, 5.5, 0.1, 0.05, -0.1};
  BeamDescription beam;
  beam.from = {0.1, 0.2, 0}, beam.to = {0.1, 2.2, 0};
  beam.mass_per_length = 3, beam.rotary_inertia = 0.01;
  beam.bending_stiffness_y = 100, beam.bending_stiffness_z = 200, beam.torsional_stiffness = 50;
  beam.segments = 3;
  link.beam = beam;
  robot.bodies.push_back(link);
  BodyDescription hand;
  hand.name = "hand", hand.parent = "arm", hand.joint.name = "wrist", hand.joint.type = JointType::revolute;
  hand.X_PF.p = {0.1, 2.3, 0};
  hand.mass = 2, hand.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.1);
  robot.bodies.push_back(hand);
  EndEffectorSetup tip;
  tip.name = "tip", tip.body = "arm", tip.X_BE.p = {0.1, 1.2, 0.05};
  robot.end_effectors.push_back(tip);
  Geometry tube;
  tube.shape = Geometry::Shape::cylinder, tube.size = {0.05, 1.8, 0};
  tube.X_BG = {rotation_about({1, 0, 0}, std::numbers::pi / 2), {0.1, 1.2, 0}};
  Geometry knob;
  knob.shape = Geometry::Shape::sphere, knob.size = {0.1, 0, 0}, knob.X_BG.p = {0.1, 2.25, 0};
  robot.geometry = {{"arm", tube}, {"arm", knob}};
  return robot;
}

TEST(FlexibleRobot, HasTheMassAndInertiaOfTheRigidOne) {
  const RobotSetup robot = with_link();
  ModelBuilder rigid;
  for (const BodyDescription& body : rigid_robot(robot).bodies) rigid.add(body);
  const RigidBodyInertiad a = total_of(rigid.build()), b = total_of(model_of(robot));
  EXPECT_NEAR(a.mass, b.mass, 1e-13);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a.first_moment[k], b.first_moment[k], 1e-13);
  EXPECT_NEAR(a.rotational.xx, b.rotational.xx, 1e-12);
  EXPECT_NEAR(a.rotational.yy, b.rotational.yy, 1e-12);
  EXPECT_NEAR(a.rotational.zz, b.rotational.zz, 1e-12);
  EXPECT_NEAR(a.rotational.xy, b.rotational.xy, 1e-12);
  EXPECT_NEAR(a.rotational.xz, b.rotational.xz, 1e-12);
  EXPECT_NEAR(a.rotational.yz, b.rotational.yz, 1e-12);
}

TEST(FlexibleRobot, KeepsAttachmentsInPlace) {
  const RobotSetup robot = with_link(), flexible = flexible_robot(robot);
  ASSERT_TRUE(flexible.undeformed);
  const Model model = model_of(robot);
  const Kinematics k = forward_kinematics(model, zero_state(model));
  const Posed& X_WA = k.X_WB[model.body_index("arm")];
  const auto place = [&](const std::string& body, const Vector3d& p) { return k.X_WB[model.body_index(body)] * p; };
  // The hand is on the last segment, the end-effector and the shapes on those between.
  EXPECT_EQ(model.bodies()[model.bodies()[model.body_index("hand")].parent].description.name, "arm:6");
  EXPECT_LT(norm(place("hand", Vector3d::zero()) - X_WA * Vector3d{0.1, 2.3, 0}), 1e-14);
  const EndEffectorSetup& tip = flexible.end_effectors[0];
  EXPECT_EQ(tip.body, "arm:3");
  EXPECT_LT(norm(place(tip.body, tip.X_BE.p) - X_WA * Vector3d{0.1, 1.2, 0.05}), 1e-14);
  double length = 0;
  for (const auto& [body, shape] : flexible.geometry) {
    if (shape.shape == Geometry::Shape::sphere) {
      EXPECT_EQ(body, "arm:6");
    }
    if (shape.shape == Geometry::Shape::cylinder) length += shape.size[1];
  }
  EXPECT_NEAR(length, 1.8, 1e-14);
  EXPECT_EQ(flexible.geometry.size(), 8u);  // seven segments of the tube, and the knob
  // The order of the driven joints is that of the rigid robot.
  std::vector<std::string> driven;
  for (const int body : model.joints()) {
    if (!yields(model.bodies()[body].description.joint)) driven.push_back(model.bodies()[body].description.joint.name);
  }
  EXPECT_THAT(driven, ::testing::ElementsAre("shoulder", "wrist"));
  EXPECT_THAT(pieces_of(model, "arm"), ::testing::SizeIs(7));
  EXPECT_EQ(link_of_piece(model.bodies()[model.body_index("arm:3")].description), "arm");
  EXPECT_EQ(link_of_piece(model.bodies()[model.body_index("arm")].description), "arm");
  EXPECT_EQ(link_of_piece(model.bodies()[model.body_index("base")].description), "base");
}

TEST(FlexibleRobot, WithoutFlexiblePartsEqualsTheRobot) {
  RobotSetup robot = with_link();
  EXPECT_TRUE(is_flexible(robot));
  robot.bodies[1].beam.reset();
  EXPECT_FALSE(is_flexible(robot));
  EXPECT_EQ(flexible_robot(robot).bodies.size(), robot.bodies.size());
  EXPECT_FALSE(flexible_robot(robot).undeformed);
}

TEST(FlexibleRobot, RestsWithUndeflectedSprings) {
  RobotSetup robot = with_link();
  robot.bodies[2].joint.spring = JointSpring{10, 0, 0.4};
  const RobotSetup rigid = rigid_robot(robot);
  EXPECT_EQ(rigid.bodies[2].joint.type, JointType::fixed);
  EXPECT_NEAR(rotation_angle(rigid.bodies[2].X_PF.R), 0.4, 1e-14);
}

TargetSetup target_with_panels() {
  TargetSetup target;
  target.name = "satellite", target.mass = 100, target.com = {0.1, 0, 0};
  target.inertia = Symmetric3d::diagonal(60, 50, 80);
  PanelSetup panel;
  panel.name = "wing", panel.X_TP = {rotation_about({0, 0, 1}, std::numbers::pi / 2), {0, 0.5, 0.1}};
  panel.mass = 6, panel.com = {1, 0, 0}, panel.inertia = Symmetric3d::diagonal(0.5, 2, 2.5);
  BeamDescription beam;
  beam.to = {2, 0, 0}, beam.bending_stiffness_y = 30, beam.segments = 1;
  panel.beam = beam;
  target.panels.push_back(panel);
  panel.name = "antenna", panel.X_TP.p = {0.4, -0.5, 0}, panel.beam.reset();
  panel.hinge_axis = Vector3d{1, 0, 0}, panel.hinge = JointSpring{5, 0.1, 0.3};
  target.panels.push_back(panel);
  return target;
}

TEST(TargetBodies, AddUpToTheWholeTarget) {
  const TargetSetup target = target_with_panels();
  ModelBuilder builder;
  for (BodyDescription body : target_bodies(target).bodies) builder.add(std::move(body));
  const Model model = builder.build();
  std::vector<std::string> names;
  for (const Body& body : model.bodies()) names.push_back(body.description.name);
  EXPECT_THAT(names, ::testing::ElementsAre("target:satellite", "target:satellite/wing", "target:satellite/wing:1",
                                            "target:satellite/wing:2", "target:satellite/antenna"));
  State state = zero_state(model);
  for (const int body : model.springs())
    state.q[model.bodies()[body].q] = model.bodies()[body].description.joint.spring->rest;
  const Kinematics k = forward_kinematics(model, state);
  RigidBodyInertiad total = RigidBodyInertiad::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i)
    total += shift_origin(world_inertia(model, k, static_cast<int>(i)), k.X_WB[i].p);
  EXPECT_NEAR(total.mass, 100, 1e-12);
  EXPECT_LT(norm(total.com() - target.com), 1e-13);
  EXPECT_NEAR(total.rotational_about_com().xx, 60, 1e-11);
  EXPECT_NEAR(total.rotational_about_com().yy, 50, 1e-11);
  EXPECT_NEAR(total.rotational_about_com().zz, 80, 1e-11);
  EXPECT_NEAR(total.rotational_about_com().xy, 0, 1e-11);
}

TEST(TargetBodies, RejectInvalidPanels) {
  TargetSetup target = target_with_panels();
  EXPECT_EQ(panel_fault(target), "");
  target.mass = 11;
  EXPECT_THAT(panel_fault(target), HasSubstr("the panels have 12 kg"));
  target.mass = 100, target.inertia.yy = target.inertia.xx = target.inertia.zz = 12;
  EXPECT_THAT(panel_fault(target), HasSubstr("is not that of a rigid body"));
  target = target_with_panels();
  target.panels[1].name = "wing";
  EXPECT_THAT(panel_fault(target), HasSubstr("two panels are called 'wing'"));
  target.panels[1].name = "..";
  EXPECT_THAT(panel_fault(target), HasSubstr("not a valid name of a panel"));
  target = target_with_panels();
  target.panels[0].beam->bending_stiffness_y.reset();
  EXPECT_THAT(panel_fault(target), HasSubstr("panel 'wing': a beam needs"));
}

TEST(BeamFault, RejectsInvalidBeams) {
  const auto fault = [](auto change) {
    BodyDescription link = with_link().bodies[1];
    change(link);
    return beam_fault(link);
  };
  EXPECT_EQ(fault([](BodyDescription&) {}), "");
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->to = l.beam->from; }), HasSubstr("must differ"));
  EXPECT_THAT(fault([](BodyDescription& l) {
                l.beam->bending_stiffness_y.reset(), l.beam->bending_stiffness_z.reset();
                l.beam->torsional_stiffness.reset();
              }),
              HasSubstr("needs bending_stiffness_y"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->mass_per_length = 7; }), HasSubstr("more than the 12 kg"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.inertia = Symmetric3d::diagonal(2.2, 1, 2.2); }),
              HasSubstr("are not those of a rigid body"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->section_y = Vector3d{0, 2, 0}; }), HasSubstr("along the beam"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->rotary_inertia = 0; }), HasSubstr("needs rotary_inertia"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->mass_per_length.reset(); }), HasSubstr("must be the beam's"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.beam->from = {0.1, -0.3, 0}; }), HasSubstr("before the link's joint"));
  EXPECT_THAT(fault([](BodyDescription& l) { l.parent.clear(); }), HasSubstr("the base cannot be a beam"));
  JointDescription joint;
  joint.type = JointType::revolute;
  EXPECT_THAT(gear_fault(joint), HasSubstr("needs rotor_inertia"));
  joint.type = JointType::fixed;
  EXPECT_THAT(gear_fault(joint), HasSubstr("one axis"));
}

// With a payload on the link: its lower frequencies make the modes admissible.
TEST(BeamFault, ReportsTooManyOrTooFastModes) {
  RobotSetup robot = only_base(100, 20);
  robot.bodies.push_back(slender_link("beam", "base", JointType::revolute, 1, 2, 2000, 2));
  BodyDescription& link = robot.bodies[1];
  EXPECT_EQ(beam_modes_fault(robot, link), "");
  link.beam->modes = 5;
  EXPECT_EQ(beam_modes_fault(robot, link), "5 of each kind are more than the 4 that 2 segments have");
  link.beam->modes = 2;
  EXPECT_THAT(beam_modes_fault(robot, link), HasSubstr("mode 2 of bending about z has 1"));
  EXPECT_THAT(beam_modes_fault(robot, link), HasSubstr("above the 100 Hz of fastest_mode: keep 1 of each kind, or"));
  link.beam->modes = 1;
  EXPECT_EQ(beam_modes_fault(robot, link), "");
  link.beam->fastest_mode = 10;
  EXPECT_THAT(beam_modes_fault(robot, link), HasSubstr("mode 1 of bending about z has 17.69 Hz"));
  BodyDescription load = robot.bodies[0];
  load.name = "load", load.parent = "beam", load.X_PF.p = {1, 0, 0}, load.joint.name = "wrist";
  load.joint.type = JointType::revolute;
  robot.bodies.push_back(load);
  EXPECT_EQ(beam_modes_fault(robot, robot.bodies[1]), "");
}

}  // namespace flexible_robot_test
}  // namespace grapnel::testing
