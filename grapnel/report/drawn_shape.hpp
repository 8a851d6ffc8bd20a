#pragma once

/// @file
/// Shapes of bodies for drawing, and their triangles: for pictures and for glTF.

#include <array>
#include <string>
#include <vector>

#include "grapnel/report/run_data.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {

/// The shapes of a body in its frame. A body without shapes in the scene gets default shapes: a link rods (capsules)
/// from its joint to its child joints and end-effectors; any other body the box of uniform density with the same
/// inertia, or a small sphere for a point mass. A link with rods of zero length gets a box.
std::vector<SceneShape> drawn_shapes(const Scene& scene, std::size_t body);

/// The box [edge lengths] of uniform density with this inertia about its centre, turned by X_BG.R.
SceneShape box_of_inertia(const SceneBody& body);

/// A ball that contains all bodies of a run at all samples.
struct MotionExtent {
  Vector3d centre = Vector3d::zero();  // in W [m]
  double radius = 0;                   // [m]
};
/// @throws std::runtime_error if a body's motion is not recorded. `run` must have a scene.
MotionExtent motion_extent(const RunSource& run);

/// The shapes of an obstacle in its frame. A half-space gets a square plate below its surface, whose edges are as long
/// as the extent's diameter, about the point of the surface nearest to the extent's centre.
std::vector<SceneShape> drawn_shapes(const SceneObstacle& obstacle, const MotionExtent& extent);

struct DrawnMesh {
  std::vector<Vector3d> points;
  std::vector<Vector3d> normals;              // unit, outwards, one per point
  std::vector<std::array<int, 3>> triangles;  // counter-clockwise seen from outside
};

/// Triangles of a shape in the body's frame. `facets`: around a circle. Throws std::runtime_error for a shape that is
/// none of scene.hpp's.
DrawnMesh triangles_of(const Scene& scene, const SceneShape& shape, int facets = 32);

// Outlines of bodies as seen from far away.

using Point2 = std::array<double, 2>;

/// An orthographic view: unit vectors in W to the right, upwards, and towards the reader.
struct View {
  Vector3d right, up, towards;
  std::string right_name, up_name;  // of the axes, "x"; empty if the picture's axes are not axes of W

  Point2 operator()(const Vector3d& p) const { return {dot(right, p), dot(up, p)}; }
};

/// "x", "y", "z": along that axis of W; "iso": from (1, 1, 1), z upwards. Throws std::invalid_argument otherwise.
View view_along(const std::string& name);

/// The convex hull of points, counter-clockwise, without its first point repeated.
std::vector<Point2> convex_hull(std::vector<Point2> points);

/// A shape prepared for drawing in many poses.
class Silhouette {
 public:
  Silhouette(const Scene& scene, const SceneShape& shape);
  /// Its outline (of a mesh that of its convex hull) with the body at X_WB.
  std::vector<Point2> operator()(const Posed& X_WB, const View& view) const;
  const Vector3d& centre() const { return centre_; }  // in the body's frame

 private:
  friend std::vector<Silhouette> silhouettes_of(const Scene& scene, const SceneShape& shape);
  explicit Silhouette(std::vector<Vector3d> points);
  std::vector<Vector3d> points_;  // in the body's frame; of a sphere none
  Vector3d centre_;
  double radius_ = 0;  // of a sphere
};

/// The silhouettes of a shape: of a mesh one for each of its connected parts, since the hull of all of them would hide
/// bus, panels and dish of a satellite in one outline. Meshes of more than 256 parts have one.
std::vector<Silhouette> silhouettes_of(const Scene& scene, const SceneShape& shape);

}  // namespace grapnel
