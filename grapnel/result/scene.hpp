#pragma once

/// @file
/// What a capture's bodies look like, for drawings: filled by simulate_capture() from the problem, written as
/// scene.json, read by reports and exports. Their motion is in the time series.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// A triangle mesh in its own frame.
struct SceneMesh {
  std::string name;              // of its file
  std::vector<double> vertices;  // x, y, z in turn, in the file's unit: SceneShape::size makes them metres
  std::vector<int> triangles;    // three vertex numbers in turn
};

/// A shape on a body.
struct SceneShape {
  std::string shape;                 // box, cylinder, capsule, sphere, mesh
  Vector3d size = Vector3d::zero();  // as Geometry::size
  Posed X_BG = Posed::identity();
  int mesh = -1;  // index into Scene::meshes
};

/// How a link hangs on its parent.
struct SceneJoint {
  std::string name;
  std::string type;        // revolute, continuous, prismatic, fixed
  Vector3d axis{0, 0, 1};  // unit, in the joint's frame
  Posed X_PF = Posed::identity();
};

/// A rigid body. Names of base and links are unique, and so are targets', but a target may be called like a link.
struct SceneBody {
  std::string name;
  std::string kind;                           // base, link, target, part
  std::string parent;                         // of links
  std::optional<SceneJoint> joint;            // of links
  std::string series;                         // its motion in the time series: series + "/position", "/quaternion_wxyz"
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the body's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about com, in the body's axes [kg m^2]
  std::vector<SceneShape> shapes;
};

/// An end-effector on a body of the robot.
struct SceneFrame {
  std::string name, body;
  Posed X_BE = Posed::identity();
};

struct SceneGraspPoint {
  std::string target, name;
  Vector3d position = Vector3d::zero();        // in the target's frame [m]
  std::optional<Vector3d> approach_direction;  // unit, in the target's frame
};

struct SceneGrasp {
  std::string end_effector, target, grasp_point;
  std::string model;  // rigid, hinge, point, contact
};

/// What a grasp can close on, and what bodies are to keep from each other: lines in plots. Infinite: any.
struct SceneLimits {
  struct Grasp {
    std::string end_effector;
    double position = 0;  // from the grasp point [m]
    double velocity = 0;  // relative [m/s]
  };
  std::vector<Grasp> grasps;        // of end-effectors that have an envelope
  std::optional<double> clearance;  // required distance [m]; absent: not watched
};

struct Scene {
  bool planar = false;            // everything moves along the plane z = 0 of W
  std::vector<SceneBody> bodies;  // base first, then links (parents before children), then targets
  std::vector<SceneFrame> end_effectors;
  std::vector<SceneGraspPoint> grasp_points;
  std::vector<SceneGrasp> grasps;
  std::vector<SceneMesh> meshes;
  SceneLimits limits;
};

/// scene.json (docs/formats/scene.md): JSON with keys in a fixed order and a newline at the end.
std::string scene_json(const Scene& scene, std::string_view scenario_name, std::string_view scenario_sha256,
                       std::string_view version);

/// The scene of a result folder's scene.json: parents come before their links, and every name and index leads
/// somewhere. Throws std::runtime_error naming path and fault: missing, not JSON, not ours, what is damaged and where.
Scene read_scene(const std::filesystem::path& path);

}  // namespace grapnel
