// The scene of a capture against its time series: what a report draws must be what was simulated.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "capture/capture_case.hpp"
#include "grapnel/problem/problem_scene.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace scene_test {

const std::filesystem::path kScenarios = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios";

const Series* find_series(const CaptureResult& result, const std::string& path) {
  for (const Series& s : result.series.series) {
    if (s.path == path) return &s;
  }
  return nullptr;
}

const SceneBody& body_named(const Scene& scene, const std::string& name) {
  for (const SceneBody& b : scene.bodies) {
    if (b.name == name && b.kind != "target") return b;
  }
  throw std::invalid_argument(name);
}

// The pose X_WB of a body at a sample.
Posed recorded_pose(const CaptureResult& result, const SceneBody& body, std::size_t sample) {
  return pose_at(result, body.series, sample);
}

// Largest distance, over all samples, of the recorded end-effectors from where their links carry them; and of links
// from where their joints can be.
struct Deviation {
  double end_effectors = 0, joints = 0, out_of_plane = 0;
};
Deviation deviation_of(const CaptureResult& result) {
  Deviation largest;
  const auto up = [](double& x, double y) { x = std::max(x, std::isfinite(y) ? y : INFINITY); };
  const Scene& scene = result.scene;
  for (std::size_t s = 0; s < result.series.time.size(); ++s) {
    for (const SceneFrame& e : scene.end_effectors) {
      const Posed X_WE = recorded_pose(result, body_named(scene, e.body), s) * e.X_BE;
      const Posed recorded = pose_at(result, "end_effectors/" + e.name, s);
      up(largest.end_effectors, norm(X_WE.p - recorded.p));
      up(largest.end_effectors, rotation_angle(transpose(X_WE.R) * recorded.R));
    }
    for (const SceneBody& b : scene.bodies) {
      const Posed X_WB = recorded_pose(result, b, s);
      up(largest.out_of_plane, std::abs((X_WB * b.com - recorded_pose(result, b, 0) * b.com)[2]));
      if (!b.joint) continue;
      const Posed X_WF = recorded_pose(result, body_named(scene, b.parent), s) * b.joint->X_PF;
      const Vector3d axis = X_WF.R * b.joint->axis;
      // A rotary joint keeps its origin, a sliding one its orientation and, across its axis, its place.
      const Vector3d slip = X_WB.p - X_WF.p;
      if (b.joint->type == "prismatic") {
        up(largest.joints, norm(cross(axis, slip)));
        up(largest.joints, rotation_angle(transpose(X_WF.R) * X_WB.R));
      } else {
        up(largest.joints, norm(slip));
        up(largest.joints, norm(axis - X_WB.R * b.joint->axis));
      }
      if (b.joint->type == "fixed") up(largest.joints, rotation_angle(transpose(X_WF.R) * X_WB.R));
    }
  }
  return largest;
}

// Names lead somewhere, parents come first, and every body's motion is recorded.
void expect_complete(const CaptureResult& result, const CaptureProblem& problem) {
  const Scene& scene = result.scene;
  ASSERT_EQ(scene.bodies.size(), problem.robot.bodies.size() + problem.targets.size());
  EXPECT_EQ(scene.bodies[0].name, problem.robot.base);
  EXPECT_EQ(scene.bodies[0].kind, "base");
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const SceneBody& b = scene.bodies[i];
    for (const char* what : {"/position", "/quaternion_wxyz"})
      EXPECT_NE(find_series(result, b.series + what), nullptr) << b.series << what;
    if (b.kind != "link") continue;
    const auto before = std::find_if(scene.bodies.begin(), scene.bodies.begin() + static_cast<std::ptrdiff_t>(i),
                                     [&](const SceneBody& p) { return p.name == b.parent; });
    EXPECT_NE(before, scene.bodies.begin() + static_cast<std::ptrdiff_t>(i)) << b.name;
  }
  EXPECT_EQ(scene.end_effectors.size(), problem.robot.end_effectors.size());
  ASSERT_EQ(scene.grasps.size(), problem.grasps.size());
  std::size_t points = 0;
  for (const TargetSetup& t : problem.targets) points += t.grasp_points.size();
  EXPECT_EQ(scene.grasp_points.size(), points);
}

std::vector<std::filesystem::path> shipped() {
  std::vector<std::filesystem::path> files;
  for (const auto& file : std::filesystem::recursive_directory_iterator(kScenarios)) {
    if (file.path().extension() == ".yaml") files.push_back(file.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Shortened: one second of approach as planned for all of it says as much about drawing.
CaptureResult brief_run(CaptureProblem problem) {
  if (problem.post_impact) problem.post_impact->duration = std::min(problem.post_impact->duration, 2.0);
  if (problem.post_impact) {
    std::erase_if(problem.post_impact->releases,
                  [&](const PostImpactSetup::Release& r) { return r.after >= problem.post_impact->duration; });
    const double end = (problem.approach ? problem.approach->duration : 0) + problem.post_impact->duration;
    for (GraspSetup& g : problem.grasps) g.closes_at = std::min(g.closes_at, end);
  }
  problem.clearance.enabled = false;
  problem.output_interval = 1;
  return simulate_capture(problem);
}

TEST(Scene, MovesAsWasSimulated) {
  double end_effectors = 0, joints = 0;
  int planar = 0, spatial = 0;
  for (const std::filesystem::path& file : shipped()) {
    const CaptureProblem problem = load_scenario(file);
    const CaptureResult result = brief_run(problem);
    ASSERT_EQ(result.status, CaptureStatus::completed) << file << result.failure;
    expect_complete(result, problem);
    const Deviation d = deviation_of(result);
    EXPECT_LT(d.end_effectors, 1e-12) << file;  // measured below
    EXPECT_LT(d.joints, 1e-12) << file;
    if (result.scene.planar) {
      EXPECT_LT(d.out_of_plane, 1e-12) << file;
    } else {
      EXPECT_GT(d.out_of_plane, 1e-3) << file;  // it is not planar, and does not look so
    }
    ++(result.scene.planar ? planar : spatial);
    end_effectors = std::max(end_effectors, d.end_effectors);
    joints = std::max(joints, d.joints);
  }
  EXPECT_EQ(planar, 16);  // the thesis's, and first-plan
  EXPECT_GT(spatial, 10);
  std::printf("[ measured ] %d planar, %d spatial; end-effectors %.2g, joints %.2g\n", planar, spatial, end_effectors,
              joints);
}

// Branched robots with joints of all kinds, links in any order.
TEST(Scene, OfRandomRobots) {
  for (int i = 0; i < 12; ++i) {
    const CaptureProblem problem = random_capture(i);
    const CaptureResult result = simulate_capture(problem);
    expect_complete(result, problem);
    EXPECT_FALSE(result.scene.planar);
    const Deviation d = deviation_of(result);
    EXPECT_LT(d.end_effectors, 1e-12) << i;
    EXPECT_LT(d.joints, 1e-12) << i;
  }
}

TEST(Scene, SaysWhatTheProblemSays) {
  CaptureProblem p = thesis_case();
  p.robot.geometry = {{p.robot.bodies[2].name,
                       {Geometry::Shape::capsule, {0.05, 0.9, 0}, {rotation_about({0, 1, 0}, 1.5), {0.5, 0, 0}}}}};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{0, -1, 0};
  p.grasps[1].model = GraspModel::hinge;
  const Scene scene = scene_of(p);
  EXPECT_TRUE(scene.planar);
  for (const BodyDescription& b : p.robot.bodies) {
    const SceneBody& s = body_named(scene, b.name);
    EXPECT_EQ(s.mass, b.mass);
    EXPECT_EQ(norm(s.com - b.com), 0);
    EXPECT_EQ(s.inertia.zz, b.inertia.zz);
    EXPECT_EQ(s.shape.has_value(), b.name == p.robot.bodies[2].name);
    if (b.name == p.robot.base) continue;
    EXPECT_EQ(s.parent, b.parent);
    EXPECT_EQ(s.joint->name, b.joint.name);
    EXPECT_EQ(s.joint->type, "revolute");
    EXPECT_EQ(norm(s.joint->X_PF.p - b.X_PF.p), 0);
  }
  const SceneShape& shape = *body_named(scene, p.robot.bodies[2].name).shape;
  EXPECT_EQ(shape.shape, "capsule");
  EXPECT_EQ(shape.size[1], 0.9);
  EXPECT_EQ(shape.X_BG.p[0], 0.5);
  EXPECT_EQ(scene.bodies.back().name, "target-2");
  EXPECT_EQ(scene.bodies.back().series, "targets/target-2");
  EXPECT_FALSE(scene.bodies.back().shape);
  EXPECT_EQ(scene.grasp_points[0].position[1], 0.5);
  EXPECT_EQ((*scene.grasp_points[0].approach_direction)[1], -1);
  EXPECT_FALSE(scene.grasp_points[1].approach_direction);
  EXPECT_EQ(scene.grasps[0].model, "rigid");
  EXPECT_EQ(scene.grasps[1].model, "hinge");
}

TEST(Scene, SharesMeshes) {
  CaptureProblem p = thesis_case();
  const auto mesh = std::make_shared<const TriangleMesh>(
      TriangleMesh{"part.stl", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}}, {}});
  const auto other = std::make_shared<const TriangleMesh>(*mesh);
  p.targets[0].geometry = {Geometry::Shape::mesh, {0.1, 0.1, 0.1}, Posed::identity(), mesh};
  p.targets[1].geometry = {Geometry::Shape::mesh, {0.2, 0.2, 0.2}, Posed::identity(), mesh};
  p.robot.geometry = {{p.robot.base, {Geometry::Shape::mesh, {1, 1, 1}, Posed::identity(), other}}};
  const Scene scene = scene_of(p);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.bodies[0].shape->mesh, 0);
  EXPECT_EQ(scene.bodies[scene.bodies.size() - 2].shape->mesh, 1);
  EXPECT_EQ(scene.bodies.back().shape->mesh, 1);
  EXPECT_EQ(scene.bodies.back().shape->size[0], 0.2);
  EXPECT_EQ(scene.meshes[1].name, "part.stl");
  EXPECT_EQ(scene.meshes[1].vertices, (std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(scene.meshes[1].triangles, (std::vector<int>{0, 2, 1, 0, 1, 3}));
}

// What takes a planar capture out of its plane, one thing at a time.
TEST(Scene, PlanarOnlyIfEverythingIs) {
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
  const LoadSetup pull{"base", {0, 0, 0}, false, {{0, 0, 0}, {0, 0, 1}}, {}};
  EXPECT_FALSE(with([&](auto& p) { p.loads = {pull}, p.loads[0].body = p.robot.base; }));
  // And what does not.
  EXPECT_TRUE(with([](auto& p) { p.X_WB = {rotation_about({0, 0, 1}, 1), {3, 4, 0}}; }));
  EXPECT_TRUE(with([](auto& p) { p.V_WB = Twistd{{0, 0, 0.1}, {1, 2, 0}}; }));
  EXPECT_TRUE(with([](auto& p) { p.grasps[0].model = GraspModel::hinge; }));
  // Two arms of a fork above and below the plane, and one alone.
  BodyDescription prong = planar.robot.bodies.back();
  prong.parent = prong.name, prong.name = "upper", prong.joint = {}, prong.joint.name = "upper-mount";
  prong.X_PF.p = {0, 0, 0.3};
  BodyDescription lower = prong;
  lower.name = "lower", lower.joint.name = "lower-mount", lower.X_PF.p[2] = -0.3;
  EXPECT_TRUE(with([&](auto& p) { p.robot.bodies.push_back(prong), p.robot.bodies.push_back(lower); }));
  EXPECT_FALSE(with([&](auto& p) { p.robot.bodies.push_back(prong); }));
}

TEST(Scene, IsThereAlsoIfTheRunFails) {
  CaptureProblem p = thesis_case();
  p.contact = {ContactSetup::Gap::refuse, 1e-12};
  p.targets[0].X_WT.p[0] += 0.1;
  const CaptureResult result = simulate_capture(p);
  EXPECT_EQ(result.status, CaptureStatus::failed);
  EXPECT_EQ(result.scene.bodies.size(), p.robot.bodies.size() + 2);
  EXPECT_TRUE(simulate_impact_only(thesis_case()).scene.bodies.empty());  // of which nothing is recorded
}

}  // namespace scene_test
}  // namespace grapnel::testing
