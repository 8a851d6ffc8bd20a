#include "report/sample_run.hpp"

#include <cmath>

namespace grapnel::test {
namespace {

SceneBody body(const std::string& name, const std::string& kind, const std::string& series) {
  SceneBody it;
  it.name = name, it.kind = kind, it.series = series;
  it.mass = 12, it.inertia = {2, 3, 4, 0.1, 0.2, -0.1};
  return it;
}

void add_pose(TimeSeries& series, const std::string& path, const Vector3d& axis, double rate, const Vector3d& start,
              const Vector3d& velocity) {
  Series position{path + "/position", "m", "", {"x", "y", "z"}, {}},
      quaternion{path + "/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}};
  Series linear{path + "/velocity", "m/s", "", {"x", "y", "z"}, {}},
      angular{path + "/angular_velocity", "rad/s", "", {"x", "y", "z"}, {}};
  // The base sways, so that linear interpolation between samples has errors.
  for (const double t : series.time) {
    const Vector3d p = start + t * velocity + Vector3d{0, path == "base" ? 0.05 * std::sin(0.5 * t) : 0, 0};
    // w >= 0: the sign jumps, as for quaternions computed from matrices.
    const Quaterniond q = quaternion_from(rotation_about(axis, rate * t));
    position.data.insert(position.data.end(), {p[0], p[1], p[2]});
    quaternion.data.insert(quaternion.data.end(), {q.w, q.x, q.y, q.z});
    linear.data.insert(linear.data.end(), {velocity[0], velocity[1], velocity[2]});
    angular.data.insert(angular.data.end(), {rate * axis[0], rate * axis[1], rate * axis[2]});
  }
  for (Series* s : {&position, &quaternion, &linear, &angular}) series.series.push_back(*s);
}

}  // namespace

RunSource sample_run(bool planar, const std::string& odd, double spin) {
  RunSource run;
  run.folder = "made-up";
  run.metadata = {"1.2.3", "made up" + odd, "0123456789abcdef"};
  TimeSeries& series = run.series;
  series.phases = {"approach", "contact", "post_impact"};
  const auto sample = [&](double time, int phase) { series.time.push_back(time), series.phase.push_back(phase); };
  for (int i = 0; i <= 100; ++i) sample(0.1 * i, 0);
  sample(10, 1), sample(10, 1);
  for (int i = 0; i <= 100; ++i) sample(10 + 0.1 * i, 2);

  const double up = planar ? 0 : 1;
  const Vector3d axis = planar ? Vector3d{0, 0, 1} : Vector3d{0.6, 0, 0.8};
  add_pose(series, "base", {0, 0, 1}, 0.05, {0, 0, 0}, {0.01, 0, 0});
  add_pose(series, "links/one", {0, 0, 1}, 0.1, {0.5, 0, up * 0.2}, {0.01, 0.02, 0});
  add_pose(series, "links/two", {0, 0, 1}, 0.2, {1.5, 0, up * 0.2}, {0, 0.05, 0});
  add_pose(series, "end_effectors/tip", {0, 0, 1}, 0.2, {2.2, 0, up * 0.2}, {0, 0.05, 0});
  add_pose(series, "targets/ball", axis, spin, {3, 1, 0}, {-0.03, 0, up * 0.01});
  Series angles{"joints/position", "rad", "", {"joint-1" + odd, "joint-2" + odd}, {}};
  Series rates{"joints/velocity", "rad/s", "", {"joint-1" + odd, "joint-2" + odd}, {}};
  for (std::size_t i = 0; i < series.time.size(); ++i) {
    angles.data.insert(angles.data.end(), {std::sin(0.3 * series.time[i]), std::cos(0.2 * series.time[i])});
    rates.data.insert(rates.data.end(), {series.phase[i] == 0 ? 0.1 : 0.25, -0.1});
  }
  series.series.push_back(angles), series.series.push_back(rates);

  Scene scene;
  scene.planar = planar;
  scene.bodies = {body("base" + odd, "base", "base"), body("one", "link", "links/one"),
                  body("two", "link", "links/two"), body("ball", "target", "targets/ball")};
  scene.bodies[1].parent = "base" + odd, scene.bodies[2].parent = "one";
  scene.bodies[1].joint = SceneJoint{"joint-1" + odd, "revolute", {0, 0, 1}, {Rotationd::identity(), {0.5, 0, 0}}};
  scene.bodies[2].joint = SceneJoint{"joint-2" + odd, "revolute", {0, 0, 1}, {Rotationd::identity(), {1, 0, 0}}};
  scene.bodies[2].shapes = {
      {"cylinder", {0.05, 0.7, 0}, {rotation_about({0, 1, 0}, 1.5707963267948966), {0.35, 0, 0}}, -1}};
  scene.bodies[3].shapes = {{"sphere", {0.5, 0, 0}, Posed::identity(), -1}};
  scene.end_effectors = {{"tip", "two", {Rotationd::identity(), {0.7, 0, 0}}}};
  scene.grasp_points = {{"ball", "grasp", {-0.5, 0, 0}, std::nullopt}};
  scene.grasps = {{"tip", "ball", "grasp", "rigid"}};
  run.scene = scene;
  return run;
}

}  // namespace grapnel::test
