// The scene of a capture against its time series: a report must draw the simulated motion.
#include <gtest/gtest.h>

#include "capture/capture_case.hpp"
#include "capture/scene_check.hpp"
#include "grapnel/problem/problem_scene.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace scene_test {

// Branched robots with joints of all kinds, links in any order.
TEST(Scene, OfRandomRobots) {
  for (int i = 0; i < test::repetitions(12); ++i) {
    const CaptureProblem problem = random_capture(i);
    const CaptureResult result = simulate_capture(problem);
    expect_complete_scene(result, problem);
    EXPECT_FALSE(result.scene.planar);
    const SceneDeviation d = scene_deviation(result);
    EXPECT_LT(d.end_effectors, 1e-12) << i;
    EXPECT_LT(d.joints, 1e-12) << i;
  }
}

TEST(Scene, MatchesProblem) {
  CaptureProblem p = thesis_case();
  p.robot.geometry = {{p.robot.bodies[2].name,
                       {Geometry::Shape::capsule, {0.05, 0.9, 0}, {rotation_about({0, 1, 0}, 1.5), {0.5, 0, 0}}}},
                      {p.robot.bodies[2].name, {Geometry::Shape::sphere, {0.2, 0, 0}}}};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{0, -1, 0};
  p.grasps[1].model = GraspModel::hinge;
  p.robot.bodies[2].joint.limits = {-1, 2, 3, 4, {}};
  p.robot.wheels = {{"w", {0, 0, 1}, 0.1, 0.5, 300}};
  p.robot.thrusters.emplace_back();
  p.robot.thrusters[0].name = "jet", p.robot.thrusters[0].position = {0.1, 0.2, 0}, p.robot.thrusters[0].force = 22;
  p.robot.thrusters[0].specific_impulse = 220;
  const Scene scene = scene_of(p);
  EXPECT_TRUE(scene.planar);
  ASSERT_FALSE(scene.limits.joints.empty());
  const auto limit = std::find_if(scene.limits.joints.begin(), scene.limits.joints.end(),
                                  [&](const auto& one) { return one.joint == p.robot.bodies[2].joint.name; });
  ASSERT_NE(limit, scene.limits.joints.end());
  EXPECT_EQ(limit->lower, -1);
  EXPECT_EQ(limit->upper, 2);
  EXPECT_EQ(limit->rate, 3);
  EXPECT_EQ(limit->effort, 4);
  ASSERT_EQ(scene.actuators.size(), 2u);
  EXPECT_EQ(scene.actuators[0].kind, "wheel");
  EXPECT_FALSE(scene.actuators[0].position);
  EXPECT_EQ(scene.actuators[0].limit, 300);
  EXPECT_EQ(scene.actuators[1].position->e[1], 0.2);
  EXPECT_FALSE(scene.central_body);
  for (const BodyDescription& b : p.robot.bodies) {
    const SceneBody& s = body_named(scene, b.name);
    EXPECT_EQ(s.mass, b.mass);
    EXPECT_EQ(norm(s.com - b.com), 0);
    EXPECT_EQ(s.inertia.zz, b.inertia.zz);
    EXPECT_EQ(s.shapes.size(), b.name == p.robot.bodies[2].name ? 2u : 0u);
    if (b.name == p.robot.base) continue;
    EXPECT_EQ(s.parent, b.parent);
    EXPECT_EQ(s.joint->name, b.joint.name);
    EXPECT_EQ(s.joint->type, "revolute");
    EXPECT_EQ(norm(s.joint->X_PF.p - b.X_PF.p), 0);
  }
  const SceneShape& shape = body_named(scene, p.robot.bodies[2].name).shapes[0];
  EXPECT_EQ(shape.shape, "capsule");
  EXPECT_EQ(shape.size[1], 0.9);
  EXPECT_EQ(shape.X_BG.p[0], 0.5);
  EXPECT_EQ(body_named(scene, p.robot.bodies[2].name).shapes[1].shape, "sphere");
  EXPECT_EQ(scene.bodies.back().name, "target-2");
  EXPECT_EQ(scene.bodies.back().series, "targets/target-2");
  EXPECT_TRUE(scene.bodies.back().shapes.empty());
  EXPECT_EQ(scene.grasp_points[0].position[1], 0.5);
  EXPECT_EQ((*scene.grasp_points[0].approach_direction)[1], -1);
  EXPECT_FALSE(scene.grasp_points[1].approach_direction);
  EXPECT_EQ(scene.grasps[0].model, "rigid");
  EXPECT_EQ(scene.grasps[1].model, "hinge");
}

TEST(Scene, HasTheObstacles) {
  CaptureProblem p = thesis_case();
  const Posed X_WO{rotation_about({1, 0, 0}, 0.3), {0, 0, -2}};
  p.obstacles = {{"floor", X_WO, {}}, {"post", X_WO, {{Geometry::Shape::cylinder, {0.1, 2, 0}}}}};
  const Scene scene = scene_of(p);
  ASSERT_EQ(scene.obstacles.size(), 2u);
  EXPECT_EQ(scene.obstacles[0].name, "floor");
  EXPECT_TRUE(scene.obstacles[0].half_space);
  EXPECT_EQ(scene.obstacles[0].X_WO.p[2], -2);
  EXPECT_FALSE(scene.obstacles[1].half_space);
  ASSERT_EQ(scene.obstacles[1].shapes.size(), 1u);
  EXPECT_EQ(scene.obstacles[1].shapes[0].shape, "cylinder");
}

TEST(Scene, SharesMeshes) {
  CaptureProblem p = thesis_case();
  const auto mesh = std::make_shared<const TriangleMesh>(
      TriangleMesh{"part.stl", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}}, {}});
  const auto other = std::make_shared<const TriangleMesh>(*mesh);
  p.targets[0].geometry = {{Geometry::Shape::mesh, {0.1, 0.1, 0.1}, Posed::identity(), mesh}};
  p.targets[1].geometry = {{Geometry::Shape::mesh, {0.2, 0.2, 0.2}, Posed::identity(), mesh}, Geometry{}};
  p.robot.geometry = {{p.robot.base, {Geometry::Shape::mesh, {1, 1, 1}, Posed::identity(), other}}};
  const Scene scene = scene_of(p);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.bodies[0].shapes.at(0).mesh, 0);
  EXPECT_EQ(scene.bodies[scene.bodies.size() - 2].shapes.at(0).mesh, 1);
  EXPECT_EQ(scene.bodies.back().shapes.at(0).mesh, 1);
  EXPECT_EQ(scene.bodies.back().shapes.size(), 1u);  // shapes of type none are omitted
  EXPECT_EQ(scene.bodies.back().shapes.at(0).size[0], 0.2);
  EXPECT_EQ(scene.meshes[1].name, "part.stl");
  EXPECT_EQ(scene.meshes[1].vertices, (std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(scene.meshes[1].triangles, (std::vector<int>{0, 2, 1, 0, 1, 3}));
}

// Changes that make a planar capture spatial, one at a time.
TEST(Scene, PlanarOnlyIfAllQuantitiesAre) {
  const CaptureProblem planar = thesis_case();
  ASSERT_TRUE(scene_of(planar).planar);
  const auto with = [&](auto change) {
    CaptureProblem p = planar;
    change(p);
    return scene_of(p).planar;
  };
  EXPECT_FALSE(with([](auto& p) { p.X_WB.p[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.X_WB.R = rotation_about({1, 0, 0}, 1e-6); }));
  EXPECT_FALSE(with([](auto& p) { p.V_WB = Twistd{{0, 0, 0}, {0, 0, 1e-6}}; }));
  EXPECT_FALSE(with([](auto& p) { p.V_WB = Twistd{{1e-6, 0, 0}, {0, 0, 0}}; }));
  EXPECT_FALSE(with([](auto& p) { p.momentum = Momentumd{{0, 1e-6, 0}, {0, 0, 0}}; }));
  EXPECT_FALSE(with([](auto& p) { p.gravity = {0, 0, -1}; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[1].X_WT.p[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[1].V_WT.angular[0] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[1].V_WT.linear[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[0].com[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[0].inertia.xz = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.targets[0].grasp_points[0].X_TG.p[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.robot.bodies[3].com[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.robot.bodies[3].joint.axis = {0.6, 0, 0.8}; }));
  EXPECT_FALSE(with([](auto& p) { p.robot.bodies[3].X_PF.p[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.robot.bodies[3].inertia.yz = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.robot.end_effectors[0].X_BE.p[2] = 1e-6; }));
  EXPECT_FALSE(with([](auto& p) { p.grasps[0].relative_velocity = {0, 0, 1e-6}; }));
  EXPECT_FALSE(with([](auto& p) { p.grasps[0].relative_angular_velocity = {0, 1e-6, 0}; }));
  EXPECT_FALSE(with([](auto& p) {
    p.grasps[0].model = GraspModel::hinge;
    p.grasps[0].hinge_axis = {0.6, 0, 0.8};
  }));
  const LoadSetup pull{"base", {0, 0, 0}, LoadFrame::world, {{0, 0, 0}, {0, 0, 1}}, {}};
  EXPECT_FALSE(with([&](auto& p) { p.loads = {pull}, p.loads[0].body = p.robot.base; }));
  // Changes that keep it planar.
  EXPECT_TRUE(with([](auto& p) { p.X_WB = {rotation_about({0, 0, 1}, 1), {3, 4, 0}}; }));
  EXPECT_TRUE(with([](auto& p) { p.V_WB = Twistd{{0, 0, 0.1}, {1, 2, 0}}; }));
  EXPECT_TRUE(with([](auto& p) { p.grasps[0].model = GraspModel::hinge; }));
  // Two prongs above and below the plane keep it planar; one alone does not.
  BodyDescription prong = planar.robot.bodies.back();
  prong.parent = prong.name, prong.name = "upper", prong.joint = {}, prong.joint.name = "upper-mount";
  prong.X_PF.p = {0, 0, 0.3};
  BodyDescription lower = prong;
  lower.name = "lower", lower.joint.name = "lower-mount", lower.X_PF.p[2] = -0.3;
  EXPECT_TRUE(with([&](auto& p) { p.robot.bodies.push_back(prong), p.robot.bodies.push_back(lower); }));
  EXPECT_FALSE(with([&](auto& p) { p.robot.bodies.push_back(prong); }));
}

TEST(Scene, PresentInFailedRun) {
  CaptureProblem p = thesis_case();
  p.contact = {ContactSetup::Gap::refuse, 1e-12};
  p.targets[0].X_WT.p[0] += 0.1;
  const CaptureResult result = simulate_capture(p);
  EXPECT_EQ(result.status, CaptureStatus::failed);
  EXPECT_EQ(result.scene.bodies.size(), p.robot.bodies.size() + 2);
  EXPECT_TRUE(simulate_impact_only(thesis_case()).scene.bodies.empty());  // records no motion
}

}  // namespace scene_test
}  // namespace grapnel::testing
