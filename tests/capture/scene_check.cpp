// The scene of a capture against its time series: what a report draws must be what was simulated.
#include "capture/scene_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/capture_case.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel::testing {
namespace {

const Series* find_series(const CaptureResult& result, const std::string& path) {
  for (const Series& s : result.series.series) {
    if (s.path == path) return &s;
  }
  return nullptr;
}

// The pose X_WB of a body at a sample.
Posed recorded_pose(const CaptureResult& result, const SceneBody& body, std::size_t sample) {
  return pose_at(result, body.series, sample);
}

}  // namespace

const SceneBody& body_named(const Scene& scene, const std::string& name) {
  for (const SceneBody& b : scene.bodies) {
    if (b.name == name && b.kind != "target") return b;
  }
  throw std::invalid_argument(name);
}

SceneDeviation scene_deviation(const CaptureResult& result) {
  SceneDeviation largest;
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

void expect_complete_scene(const CaptureResult& result, const CaptureProblem& problem) {
  const Scene& scene = result.scene;
  // Pieces of flexible links are separate bodies; bodies between two joints of one place are not included.
  std::vector<BodyDescription> bodies = flexible_robot(problem.robot).bodies;
  for (const TargetSetup& t : problem.targets) {
    for (BodyDescription& body : target_bodies(t).bodies) bodies.push_back(std::move(body));
  }
  ASSERT_EQ(static_cast<std::ptrdiff_t>(scene.bodies.size()),
            std::ranges::count_if(bodies, [](const BodyDescription& b) { return !is_unseen(b); }));
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

}  // namespace grapnel::testing
