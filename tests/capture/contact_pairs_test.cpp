/// The pairs of bodies that the rules of a problem select, and their laws.
#include "grapnel/problem/contact_pairs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/captured_model.hpp"

namespace grapnel::testing {
namespace contact_pairs_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

BodyDescription body(const std::string& name, const std::string& parent, const Vector3d& at) {
  BodyDescription b;
  b.name = name, b.parent = parent, b.X_PF.p = at;
  b.joint.name = name + "_joint", b.joint.type = parent.empty() ? JointType::free : JointType::prismatic;
  b.joint.axis = {1, 0, 0};
  b.mass = 2, b.inertia = {0.1, 0.1, 0.1, 0, 0, 0};
  return b;
}

Geometry ball(double radius) {
  Geometry g;
  g.shape = Geometry::Shape::sphere, g.size = {radius, 0, 0};
  return g;
}

MaterialSetup pad(const std::string& name, double stiffness) {
  MaterialSetup m;
  m.name = name, m.surface.stiffness = stiffness, m.surface.damping = 30, m.surface.static_friction = 0.5;
  return m;
}

// A bus with two sliding fingers and a sensor without shape, a target with a panel, a floor and a post. An end-effector
// on the left finger grasps the target.
CaptureProblem two_fingers() {
  CaptureProblem p;
  p.robot.base = "bus";
  p.robot.bodies = {body("bus", "", {}), body("left", "bus", {1, 1, 0}), body("right", "bus", {1, -1, 0}),
                    body("mast", "bus", {0, 0, 1})};
  for (const char* name : {"bus", "left", "right"}) p.robot.geometry.emplace_back(name, ball(0.2));
  EndEffectorSetup tip;
  tip.name = "tip", tip.body = "left";
  p.robot.end_effectors = {tip};
  p.joint_position = {0, 0, 0};
  TargetSetup stage;
  stage.name = "stage", stage.mass = 10, stage.inertia = {5, 3, 5, 0, 0, 0}, stage.geometry = {ball(0.5)};
  stage.X_WT.p = {3, 1, 0};
  stage.grasp_points.emplace_back().name = "rim";
  PanelSetup panel;
  panel.name = "wing", panel.X_TP.p = {0, 1, 0}, panel.mass = 1, panel.inertia = {0.1, 0.1, 0.1, 0, 0, 0};
  panel.geometry = {ball(0.1)};
  stage.panels = {panel};
  p.targets = {stage};
  GraspSetup grasp;
  grasp.end_effector = "tip", grasp.target = "stage", grasp.grasp_point = "rim";
  p.grasps = {grasp};
  p.obstacles.resize(2);
  p.obstacles[0].name = "floor", p.obstacles[1].name = "post";
  p.obstacles[1].geometry = {ball(0.3)};
  p.materials = {pad("soft", 1e4), pad("hard", 3e4)};
  return p;
}

const BodyName kStage = BodyName::of_target(0), kWing = BodyName::of_target(0, "wing");
const BodyName kFloor = BodyName::of_obstacle(0), kPost = BodyName::of_obstacle(1);

ContactPairsSetup rule(std::vector<std::string> materials) {
  ContactPairsSetup r;
  r.materials = std::move(materials);
  return r;
}

// "a-b" per pair, in order.
std::vector<std::string> names(const CaptureProblem& problem) {
  std::vector<std::string> all;
  for (const ContactPair& pair : contact_pairs(problem, make_capture_system(problem)))
    all.push_back(contact_name(problem, pair.a) + "-" + contact_name(problem, pair.b));
  return all;
}

TEST(ContactPairs, AreThePairsOfTheRulesEachOnce) {
  CaptureProblem p = two_fingers();
  EXPECT_THAT(names(p), IsEmpty());
  p.contacts = {rule({"soft"}), rule({"hard"})};
  p.contacts[0].pairs = {{"right", kStage}, {"left", kFloor}};
  p.contacts[1].first_group = {"left", "right"};
  p.contacts[1].second_group = {"right", kStage, kWing};
  p.contacts[1].exclude = {{kWing, "left"}};
  EXPECT_THAT(names(p), ElementsAre("right-stage", "left-floor", "left-right", "left-stage", "right-stage/wing"));
  const std::vector<ContactPair> pairs = contact_pairs(p, make_capture_system(p));
  EXPECT_DOUBLE_EQ(pairs[0].law.elastic, 3e4);  // of the later rule
  EXPECT_DOUBLE_EQ(pairs[1].law.elastic, 1e4);
}

TEST(ContactPairs, AreAllMonitoredPairsAndAllWithObstacles) {
  CaptureProblem p = two_fingers();
  p.contacts = {rule({"soft"})};
  p.contacts[0].all = true;
  p.contacts[0].exclude = {{"bus", kPost}};
  p.clearance.ignore = {{"right", kWing}};
  const auto expected =
      UnorderedElementsAre("left-right", "bus-stage", "left-stage", "right-stage", "bus-stage/wing", "left-stage/wing",
                           "bus-floor", "left-floor", "right-floor", "stage-floor", "stage/wing-floor", "left-post",
                           "right-post", "stage-post", "stage/wing-post");
  EXPECT_THAT(names(p), expected);
  p.clearance.enabled = false;  // it is another output, and does not matter here
  EXPECT_THAT(names(p), expected);
}

TEST(ContactPairs, LeavesOutBodiesWithoutShapesAndFixedOnes) {
  CaptureProblem p = two_fingers();
  p.contacts = {rule({"soft"})};
  p.contacts[0].pairs = {{"left", kStage}, {"left", kWing}, {"right", kStage}, {"bus", kFloor}, {"mast", kStage}};
  EXPECT_THAT(names(p), ElementsAre("left-stage", "left-stage/wing", "right-stage", "bus-floor"));
  p.robot.base_mode = RobotSetup::Base::fixed;
  EXPECT_THAT(names(p), ElementsAre("left-stage", "left-stage/wing", "right-stage"));
}

TEST(ContactPairs, RejectUnknownNames) {
  CaptureProblem p = two_fingers();
  const CaptureSystem system = make_capture_system(p);
  p.contacts = {rule({"sofa"})};
  EXPECT_THROW(contact_pairs(p, system), std::out_of_range);
  p.contacts = {rule({"soft"})};
  p.contacts[0].pairs = {{"left", BodyName::of_obstacle(2)}};
  EXPECT_THROW(contact_pairs(p, system), std::out_of_range);
  p.contacts[0].pairs = {{"elbow", kFloor}};
  EXPECT_THROW(contact_pairs(p, system), std::out_of_range);
}

// Groups leave out what cannot be a pair; the reasons are those that pairs named one by one are rejected for.
TEST(ContactPairs, GroupsLeaveOutConnectedBodies) {
  CaptureProblem p = two_fingers();
  p.robot.bodies.push_back(body("nail", "left", {0.1, 0, 0}));
  p.robot.bodies.back().joint.type = JointType::fixed;
  p.robot.geometry.emplace_back("nail", ball(0.1));
  p.contacts = {rule({"soft"})};
  p.contacts[0].first_group = {"bus", "left", "nail", kStage, kFloor};
  p.contacts[0].second_group = {"bus", "right", "nail", kStage, kWing, kPost};
  // A pair that the groups select in both orders has the later one.
  EXPECT_THAT(names(p), UnorderedElementsAre("stage-bus", "bus-stage/wing", "bus-post", "left-right", "left-stage",
                                             "left-stage/wing", "left-post", "nail-right", "stage-nail",
                                             "nail-stage/wing", "nail-post", "stage-right", "stage-post", "floor-bus",
                                             "floor-right", "floor-nail", "floor-stage", "floor-stage/wing"));
}

TEST(ContactPairFault, NamesTheReason) {
  CaptureProblem p = two_fingers();
  EXPECT_EQ(contact_pair_fault(p, "left", "right"), "");
  EXPECT_EQ(contact_pair_fault(p, "left", kStage), "");
  EXPECT_EQ(contact_pair_fault(p, "left", "left"), "are one body");
  EXPECT_EQ(contact_pair_fault(p, "bus", "left"),
            "are connected by joint 'left_joint', and their shapes may overlap there");
  EXPECT_EQ(contact_pair_fault(p, kStage, kWing), "are fixed to each other, so they cannot touch");
  p.targets[0].panels[0].hinge.emplace();
  EXPECT_EQ(contact_pair_fault(p, kStage, kWing), "are connected, and their shapes may overlap there");
  EXPECT_EQ(contact_pair_fault(p, kFloor, kPost), "are both fixed in W, so they cannot touch");
  EXPECT_EQ(contact_pair_fault(p, "bus", kPost), "");
  p.robot.base_mode = RobotSetup::Base::fixed;
  EXPECT_EQ(contact_pair_fault(p, "bus", kPost), "are both fixed in W, so they cannot touch");
  EXPECT_EQ(contact_pair_fault(p, "left", kPost), "");
}

// One material states the law of the contact; two state those of their surfaces, in series.
TEST(ContactLawOf, OneMaterialIsThatOfTheContact) {
  const MaterialSetup soft = pad("soft", 1e4), hard = pad("hard", 3e4);
  const ContactLaw one = contact_law_of(soft, soft, true), two = contact_law_of(soft, hard, false);
  EXPECT_DOUBLE_EQ(one.elastic, 1e4);
  EXPECT_DOUBLE_EQ(one.damping, 30);
  EXPECT_DOUBLE_EQ(one.static_friction, 0.5);
  EXPECT_DOUBLE_EQ(two.elastic, 7500);
  EXPECT_DOUBLE_EQ(two.damping, 30 * (0.75 * 0.75 + 0.25 * 0.25));
  EXPECT_DOUBLE_EQ(two.elastic_a, 1e4);
  MaterialSetup metal;
  metal.surface.modulus = 70e9, metal.surface.poisson_ratio = 0.3;
  const ContactLaw hertz = contact_law_of(metal, metal, true);
  EXPECT_DOUBLE_EQ(hertz.elastic, 0.5 * 70e9 / 0.91);
  EXPECT_THROW(contact_law_of(metal, soft, false), std::invalid_argument);
}

TEST(ContactLawOf, RestitutionGivesTheDissipation) {
  MaterialSetup m = pad("soft", 1e4);
  m.restitution = 0.6, m.restitution_speed = 0.2;
  EXPECT_DOUBLE_EQ(contact_law_of(m, m, true).dissipation, dissipation_for(0.6, 0.2));
  m.restitution = 1.5;
  EXPECT_THROW(contact_law_of(m, m, true), std::invalid_argument);
}

TEST(ContactLawOf, OnlyTwoHardMaterialsAreHard) {
  MaterialSetup hard = pad("hard", 1e4), harder = pad("harder", 3e4), soft = pad("soft", 1e4);
  hard.surface.hard = harder.surface.hard = true;
  hard.restitution = 0.6, harder.restitution = 0, soft.restitution = 0.8;
  hard.surface.rest_speed = 2e-3;
  const ContactLaw one = contact_law_of(hard, hard, true);
  EXPECT_TRUE(one.hard);
  EXPECT_DOUBLE_EQ(one.restitution, 0.6);
  EXPECT_DOUBLE_EQ(one.rest_speed, 2e-3);
  EXPECT_DOUBLE_EQ(one.dissipation, dissipation_for(0.6, 2e-3));
  // By parts of the deformation: 3/4 in the softer one.
  const ContactLaw two = contact_law_of(hard, harder, false);
  EXPECT_TRUE(two.hard);
  EXPECT_DOUBLE_EQ(two.restitution, 0.75 * 0.6);
  EXPECT_DOUBLE_EQ(two.rest_speed, 2e-3);
  EXPECT_DOUBLE_EQ(two.dissipation, 0.75 * dissipation_for(0.6, 2e-3) + 0.25 * dissipation_for(0.1, 1e-3));
  const ContactLaw mixed = contact_law_of(hard, soft, false);
  EXPECT_FALSE(mixed.hard);
  EXPECT_DOUBLE_EQ(mixed.dissipation, 0.5 * dissipation_for(0.6, 0.1) + 0.5 * dissipation_for(0.8, 0.1));
}

}  // namespace contact_pairs_test
}  // namespace grapnel::testing
