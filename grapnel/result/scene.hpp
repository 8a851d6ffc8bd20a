#pragma once

/// @file
/// Shapes of a capture's bodies for visualization: filled by simulate_capture() from the problem, written as
/// scene.json, read by reports and exports. The time series has their motion.

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
  std::vector<double> vertices;  // x, y, z of each vertex, in the file's unit: SceneShape::size converts to metres
  std::vector<int> triangles;    // three vertex indices per triangle
};

/// A shape on a body.
struct SceneShape {
  std::string shape;                 // box, cylinder, capsule, sphere, mesh
  Vector3d size = Vector3d::zero();  // as Geometry::size
  Posed X_BG = Posed::identity();
  int mesh = -1;  // index into Scene::meshes
};

/// The joint between a link and its parent.
struct SceneJoint {
  std::string name;
  std::string type;        // revolute, continuous, prismatic, fixed
  Vector3d axis{0, 0, 1};  // unit, in the joint's frame
  Posed X_PF = Posed::identity();
};

/// A rigid body. Names are unique among base and links, and among targets; a target may have the name of a link.
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

/// A body fixed in W that others may touch.
struct SceneObstacle {
  std::string name;
  Posed X_WO = Posed::identity();
  bool half_space = false;         // all points with z <= 0 in its frame
  std::vector<SceneShape> shapes;  // otherwise, in its frame
};

/// Envelopes of grasps, limits of joints and the required clearance, shown in plots. Infinite: no limit.
struct SceneLimits {
  struct Grasp {
    std::string end_effector;
    double position = 0;  // from the grasp point [m]
    double velocity = 0;  // relative [m/s]
  };
  struct Joint {
    std::string joint;
    double lower = 0, upper = 0;  // [rad or m]
    double rate = 0;              // [rad/s or m/s]
    double effort = 0;            // [N m or N]
  };
  std::vector<Grasp> grasps;        // of end-effectors that have an envelope
  std::optional<double> clearance;  // required distance [m]; absent: not monitored
  std::vector<Joint> joints;        // that have any limit
};

/// A wheel, gyro or thruster of the base.
struct SceneActuator {
  std::string name;
  std::string kind;                   // wheel, gyro, thruster
  std::optional<Vector3d> position;   // of thrusters, in the base's frame [m]; wheels and gyros have none
  Vector3d axis{0, 0, 1};             // unit, in the base's frame: of a wheel, a gimbal or a thruster's force
  std::optional<Vector3d> spin_axis;  // unit, in the base's frame: of a gyro's rotor with the gimbal at zero
  double limit = 0;                   // rate of a wheel or gimbal [rad/s], force of a thruster [N]; infinite: no limit
};

/// The body around which W falls.
struct SceneCentralBody {
  std::string name;              // earth, moon, mars
  std::optional<double> radius;  // equatorial [m]; absent: the scenario states its own gravitational parameter
};

struct Scene {
  bool planar = false;            // all motion stays in the plane z = 0 of W
  std::vector<SceneBody> bodies;  // base first, then links (parents before children), then targets
  std::vector<SceneFrame> end_effectors;
  std::vector<SceneGraspPoint> grasp_points;
  std::vector<SceneGrasp> grasps;
  std::vector<SceneMesh> meshes;
  SceneLimits limits;
  std::vector<SceneObstacle> obstacles;
  std::vector<SceneActuator> actuators;  // wheels, gyros, thrusters
  std::optional<SceneCentralBody> central_body;
};

/// scene.json (docs/formats/scene.md): JSON with keys in a fixed order and a newline at the end.
std::string scene_json(const Scene& scene, std::string_view scenario_name, std::string_view scenario_sha256,
                       std::string_view version);

/// Reads scene.json of a result folder and checks that parents precede their links and that every name and index is
/// valid. Throws std::runtime_error naming path and error: missing, not JSON, another schema, or the damaged value and
/// its location.
Scene read_scene(const std::filesystem::path& path);

}  // namespace grapnel
