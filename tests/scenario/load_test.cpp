// What the keys of a file become.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "grapnel/result/file_seal.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace load_test {

using testing::ElementsAre;

std::vector<double> list(const Vector3d& v) { return {v[0], v[1], v[2]}; }

CaptureProblem load(const std::string& text) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text));
}

TEST(Load, DefaultsAreThoseOfThePlainStructs) {
  const CaptureProblem p = load(edited(kSmallScenario, {{"impact: {duration: 1e-3}", "impact: {}"}}));
  const CaptureProblem plain;
  EXPECT_EQ(p.impact->duration, ImpactSetup{}.duration);
  EXPECT_EQ(p.approach->profile, ApproachSetup{}.profile);
  EXPECT_EQ(p.approach->tracking.mode, TrackingSetup{}.mode);
  EXPECT_EQ(p.contact.gap, plain.contact.gap);
  EXPECT_EQ(p.post_impact->joints, PostImpactSetup{}.joints);
  EXPECT_EQ(p.integration.method, plain.integration.method);
  EXPECT_EQ(p.integration.root_velocity, plain.integration.root_velocity);
  EXPECT_EQ(p.integration.relative_tolerance, plain.integration.relative_tolerance);
  EXPECT_EQ(p.integration.absolute_tolerance, plain.integration.absolute_tolerance);
  EXPECT_EQ(p.integration.step, plain.integration.step);
  EXPECT_EQ(p.integration.max_step, plain.integration.max_step);
  EXPECT_EQ(p.integration.max_steps, plain.integration.max_steps);
  EXPECT_EQ(p.output_interval, plain.output_interval);
  EXPECT_EQ(p.targets[0].given_at, TargetSetup{}.given_at);
  EXPECT_EQ(p.grasps[0].model, GraspSetup{}.model);
  const JointDescription joint;
  EXPECT_EQ(p.robot.bodies[2].joint.friction.transition_rate, joint.friction.transition_rate);
  EXPECT_EQ(p.robot.bodies[2].joint.gear_ratio, joint.gear_ratio);
  EXPECT_EQ(p.robot.bodies[2].joint.limits.upper, joint.limits.upper);
  ASSERT_TRUE(p.V_WB);
  EXPECT_FALSE(p.momentum);
  EXPECT_THAT(list(p.V_WB->linear), ElementsAre(0, 0, 0));
  EXPECT_TRUE(p.joint_rate.empty());
}

TEST(Load, EveryKey) {
  const CaptureProblem p = load(R"(schema: grapnel-scenario/1
name: every key
description: all of them
gravity: [0, 0, -9.81]
robot:
  schema: grapnel-robot/1
  name: r
  description: d
  base:
    {name: bus, mode: free, mass: 100, com: [0.1, 0.2, 0.3], inertia: [10, 11, 12, 0.1, 0.2, 0.3],
     geometry: {shape: box, size: [1, 2, 3], position: [0.1, 0, 0], rpy: [0, 0, 1.5707963267948966]}}
  links:
    # Not in the order of the tree, and branching.
    - {name: finger, parent: arm, joint: {name: slide, type: prismatic, axis: [0, 1, 0]}, mass: 1, inertia: [1, 1, 1],
       geometry: {shape: cylinder, radius: 0.1, length: 0.5}}
    - name: arm
      parent: bus
      joint:
        name: turn
        type: revolute
        axis: [0.6, 0, 0.8]
        origin: {position: [1, 2, 3], quaternion_wxyz: [0.8, 0, 0, 0.6]}
        limits: {lower: -1, upper: 2, rate: 3, effort: 4}
        friction: {viscous: 0.5, coulomb: 0.6, transition_rate: 0.01}
        rotor_inertia: 1e-4
        gear_ratio: -100
      mass: 2
      inertia: {xx: 1, yy: 2, zz: 2.5, yz: -0.1}
      geometry: {shape: sphere, radius: 0.2}
    - {name: camera, parent: arm, joint: {name: mast, type: fixed, origin: {position: [0, 0, 1]}}, mass: 1, inertia: [1, 1, 1]}
    - {name: thumb, parent: arm, joint: {name: swing, type: continuous, axis: [1, 0, 0]}, mass: 1, inertia: [1, 1, 1]}
  end_effectors:
    - {name: hand, link: finger, position: [0, 0, 0.5], rpy: [0.1, 0.2, 0.3]}
    - {name: belly, link: bus}
initial:
  base:
    position: [1, 2, 3]
    rpy: [0, 0, 3.141592653589793]
    momentum: {linear: [1, 2, 3], angular: [4, 5, 6]}
  joints: {swing: 0.3, turn: 0.1, slide: 0.2}
  joint_rates: {slide: 0.5}
targets:
  - name: t
    mass: 7
    com: [0, 0, 0.1]
    inertia: [3, 4, 5]
    geometry: {shape: box, size: [1, 1, 1]}
    state: {at: start, position: [9, 8, 7], quaternion_wxyz: [0, 0, 0, 1], angular_velocity: [0.1, 0.2, 0.3], velocity: [0.4, 0.5, 0.6]}
    grasp_points: [{name: a, position: [0, 0, 1], rpy: [0, 0, 0]}, {name: b}]
grasps:
  - {end_effector: hand, target: t, point: b, model: hinge, axis: [0, 1, 0]}
approach:
  duration: 12
  profile: cycloidal
  final_joints: [0.4, 0.5, 0.6]
  final_rates: [0.01, 0.02, 0.03]
  tracking: {mode: pd, kp: {turn: 1, slide: 2, swing: 3}, kd: [4, 5, 6]}
contact: {gap: refuse, limit: 0.02}
impact: {law: plastic, duration: 2e-3}
post_impact: {duration: 34, joints: pd, kp: 7, kd: 8}
integration: {method: rk4, root_velocity: integrated, relative_tolerance: 1e-9, absolute_tolerance: 1e-10, step: 0.01, max_step: 0.5, max_steps: 100000}
output: {interval: 0.25}
)");
  EXPECT_EQ(p.name, "every key");
  EXPECT_THAT(list(p.gravity), ElementsAre(0, 0, -9.81));
  const RobotSetup& r = p.robot;
  EXPECT_EQ(r.base, "bus");
  ASSERT_EQ(r.bodies.size(), 5u);
  EXPECT_THAT(list(r.bodies[0].com), ElementsAre(0.1, 0.2, 0.3));
  const Symmetric3d& I = r.bodies[0].inertia;
  EXPECT_THAT((std::vector<double>{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}), ElementsAre(10, 11, 12, 0.1, 0.2, 0.3));
  const BodyDescription& arm = r.bodies[2];
  EXPECT_EQ(arm.name, "arm");
  EXPECT_EQ(arm.parent, "bus");
  EXPECT_EQ(arm.inertia.yz, -0.1);
  EXPECT_EQ(arm.inertia.xy, 0);
  EXPECT_EQ(arm.joint.type, JointType::revolute);
  EXPECT_THAT(list(arm.joint.axis), ElementsAre(0.6, 0, 0.8));
  EXPECT_THAT(list(arm.X_PF.p), ElementsAre(1, 2, 3));
  EXPECT_NEAR(arm.X_PF.R(1, 0), 2 * 0.8 * 0.6, 1e-15);
  EXPECT_EQ(arm.joint.limits.lower, -1);
  EXPECT_EQ(arm.joint.limits.upper, 2);
  EXPECT_EQ(arm.joint.limits.rate, 3);
  EXPECT_EQ(arm.joint.limits.effort, 4);
  EXPECT_EQ(arm.joint.friction.viscous, 0.5);
  EXPECT_EQ(arm.joint.friction.coulomb, 0.6);
  EXPECT_EQ(arm.joint.friction.transition_rate, 0.01);
  EXPECT_EQ(arm.joint.rotor_inertia, 1e-4);
  EXPECT_EQ(arm.joint.gear_ratio, -100);
  EXPECT_EQ(r.bodies[1].joint.type, JointType::prismatic);
  EXPECT_EQ(r.bodies[3].joint.type, JointType::fixed);
  EXPECT_EQ(r.bodies[4].joint.type, JointType::continuous);
  ASSERT_EQ(r.geometry.size(), 3u);
  EXPECT_EQ(r.geometry[0].first, "bus");
  EXPECT_EQ(r.geometry[0].second.shape, Geometry::Shape::box);
  EXPECT_THAT(list(r.geometry[0].second.size), ElementsAre(1, 2, 3));
  EXPECT_NEAR(r.geometry[0].second.X_BG.R(1, 0), 1, 1e-15);
  EXPECT_EQ(r.geometry[1].second.shape, Geometry::Shape::cylinder);
  EXPECT_THAT(list(r.geometry[1].second.size), ElementsAre(0.1, 0.5, 0));
  EXPECT_EQ(r.geometry[2].second.shape, Geometry::Shape::sphere);
  EXPECT_EQ(r.end_effectors[0].body, "finger");
  EXPECT_EQ(r.end_effectors[0].X_BE.R(1, 0), rotation_from_rpy(0.1, 0.2, 0.3)(1, 0));
  EXPECT_EQ(r.end_effectors[1].body, "bus");

  EXPECT_NEAR(p.X_WB.R(0, 0), -1, 1e-15);
  ASSERT_TRUE(p.momentum);
  EXPECT_FALSE(p.V_WB);
  EXPECT_THAT(list(p.momentum->linear), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(p.momentum->angular), ElementsAre(4, 5, 6));
  // Joint order is the model's: parents first, else the file's. The arm was given after the finger that hangs on it.
  EXPECT_THAT(p.joint_position, ElementsAre(0.1, 0.3, 0.2));
  EXPECT_THAT(p.joint_rate, ElementsAre(0, 0, 0.5));
  EXPECT_THAT(p.approach->tracking.kp, ElementsAre(1, 3, 2));
  EXPECT_THAT(p.approach->tracking.kd, ElementsAre(4, 5, 6));
  EXPECT_THAT(p.approach->final_position, ElementsAre(0.4, 0.5, 0.6));
  ASSERT_TRUE(p.approach->final_rates);
  EXPECT_THAT(*p.approach->final_rates, ElementsAre(0.01, 0.02, 0.03));
  EXPECT_EQ(p.approach->profile, JointProfile::cycloidal);

  const TargetSetup& t = p.targets.at(0);
  EXPECT_EQ(t.given_at, TargetSetup::Instant::start);
  EXPECT_THAT(list(t.com), ElementsAre(0, 0, 0.1));
  EXPECT_THAT(list(t.X_WT.p), ElementsAre(9, 8, 7));
  EXPECT_NEAR(t.X_WT.R(0, 0), -1, 1e-15);
  EXPECT_THAT(list(t.V_WT.angular), ElementsAre(0.1, 0.2, 0.3));
  EXPECT_THAT(list(t.V_WT.linear), ElementsAre(0.4, 0.5, 0.6));
  ASSERT_EQ(t.grasp_points.size(), 2u);
  EXPECT_THAT(list(t.grasp_points[0].X_TG.p), ElementsAre(0, 0, 1));
  EXPECT_EQ(p.grasps[0].model, GraspModel::hinge);
  EXPECT_THAT(list(p.grasps[0].hinge_axis), ElementsAre(0, 1, 0));
  EXPECT_EQ(p.contact.gap, ContactSetup::Gap::refuse);
  EXPECT_EQ(p.contact.refuse_beyond, 0.02);
  EXPECT_EQ(p.impact->duration, 2e-3);
  EXPECT_EQ(p.post_impact->joints, PostImpactSetup::Joints::pd);
  EXPECT_EQ(p.post_impact->kp, std::vector<double>(3, 7));
  EXPECT_EQ(p.integration.method, IntegrationSetup::Method::rk4);
  EXPECT_EQ(p.integration.root_velocity, IntegrationSetup::RootVelocity::integrated);
  EXPECT_EQ(p.integration.relative_tolerance, 1e-9);
  EXPECT_EQ(p.integration.absolute_tolerance, 1e-10);
  EXPECT_EQ(p.integration.step, 0.01);
  EXPECT_EQ(p.integration.max_step, 0.5);
  EXPECT_EQ(p.integration.max_steps, 100000);
  EXPECT_EQ(p.output_interval, 0.25);
}

TEST(Load, PhasesMayBeAbsent) {
  const CaptureProblem impact_alone =
      load(edited(kSmallScenario,
                  {{"approach:\n  duration: 20\n  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}\n", ""},
                   {"post_impact: {duration: 10}\n", ""}}));
  EXPECT_FALSE(impact_alone.approach);
  EXPECT_TRUE(impact_alone.impact);
  EXPECT_FALSE(impact_alone.post_impact);
  const CaptureProblem approach_alone =
      load(edited(kSmallScenario, {{"impact: {duration: 1e-3}\npost_impact: {duration: 10}\n", ""}}));
  EXPECT_TRUE(approach_alone.approach);
  EXPECT_FALSE(approach_alone.impact);
}

TEST(Load, FixedBaseKeepsItsInitialPose) {
  const CaptureProblem p = load(edited(kSmallScenario, {{"base: {mass: 100,", "base: {mode: fixed, mass: 100,"},
                                                        {"initial:", "initial:\n  base: {position: [1, 2, 3]}"}}));
  EXPECT_EQ(p.robot.base_mode, RobotSetup::Base::fixed);
  EXPECT_EQ(p.robot.bodies[0].joint.type, JointType::fixed);
  EXPECT_THAT(list(p.robot.bodies[0].X_PF.p), ElementsAre(1, 2, 3));
}

TEST(Load, NearlyUnitQuaternionIsNormalised) {
  const CaptureProblem p =
      load(edited(kSmallScenario, {{"state: {", "state: {quaternion_wxyz: [0.7071068, 0, 0, 0.7071068], "}}));
  EXPECT_NEAR(p.targets[0].X_WT.R(1, 0), 1, 1e-15);
}

TEST(Load, KeepsSourceTexts) {
  const TemporaryFolder folder;
  folder.write("robot.yaml", small_robot());
  const std::string scenario = "description: two words\nname: test\nrobot: robot.yaml\n" +
                               std::string(kSmallScenario).substr(std::string(kSmallScenario).find("initial:"));
  const auto path = folder.write("scenario.yaml", scenario);
  const Override overrides[] = {{"approach.duration", "10"}, {"output.as_published", "true"}};
  const CaptureProblem problem = load_scenario(path, overrides);
  ASSERT_TRUE(problem.source);
  EXPECT_EQ(problem.source->description, "two words");
  ASSERT_EQ(problem.source->files.size(), 2u);
  EXPECT_EQ(problem.source->files[0].part, "scenario");
  EXPECT_EQ(problem.source->files[0].text, scenario);
  EXPECT_EQ(problem.source->files[1].part, "robot");
  EXPECT_EQ(problem.source->files[1].text, small_robot());
  EXPECT_THAT(problem.source->settings, ElementsAre("approach.duration=10", "output.as_published=true"));
  EXPECT_TRUE(problem.output_as_published);
  EXPECT_FALSE(load_scenario(path).output_as_published);
}

TEST(Load, Sha256IsThatOfTheFilesOneAfterTheOther) {
  const TemporaryFolder folder;
  EXPECT_EQ(load_scenario(folder.write("inline.yaml", kSmallScenario)).sha256, sha256(kSmallScenario));

  const std::string whole = kSmallScenario;
  const std::string scenario = "name: test\nrobot: robot.yaml\n" + whole.substr(whole.find("initial:"));
  folder.write("robot.yaml", small_robot());
  const auto path = folder.write("scenario.yaml", scenario);
  EXPECT_EQ(load_scenario(path).sha256, sha256(scenario + small_robot()));
  const std::vector<Override> overrides{{"approach.duration", "10"}};
  EXPECT_EQ(load_scenario(path, overrides).sha256, sha256(scenario + small_robot() + "--set approach.duration=10\n"));
}

}  // namespace load_test
}  // namespace grapnel::test
