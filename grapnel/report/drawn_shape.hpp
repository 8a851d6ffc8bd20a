#pragma once

/// @file
/// What a body is drawn as, and triangles of it: for pictures and for glTF.

#include <array>
#include <string>
#include <vector>

#include "grapnel/result/scene.hpp"

namespace grapnel {

/// The shapes of a body in its frame. A body that has none in the scene gets some: a link rods (capsules) from its
/// joint to the joints and end-effectors it carries; anything else the box of uniform density that has its inertia, or
/// a small sphere if it is a point mass. A link whose rods would have no length gets a box, too.
std::vector<SceneShape> drawn_shapes(const Scene& scene, std::size_t body);

/// The box [edge lengths] of uniform density with this inertia about its centre, turned by X_BG.R.
SceneShape box_of_inertia(const SceneBody& body);

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
  std::string right_name, up_name;  // of the axes, "x"; empty where the picture's axes are none of W's

  Point2 operator()(const Vector3d& p) const { return {dot(right, p), dot(up, p)}; }
};

/// "x", "y", "z": along that axis of W; "iso": from (1, 1, 1), z upwards. Throws std::invalid_argument otherwise.
View view_along(const std::string& name);

/// The convex hull of points, counter-clockwise, without its first point repeated.
std::vector<Point2> convex_hull(std::vector<Point2> points);

/// A shape made ready to be seen in many poses.
class Silhouette {
 public:
  Silhouette(const Scene& scene, const SceneShape& shape);
  /// Its outline (of a mesh that of its convex hull) with the body at X_WB.
  std::vector<Point2> operator()(const Posed& X_WB, const View& view) const;
  const Vector3d& centre() const { return centre_; }  // in the body's frame

 private:
  std::vector<Vector3d> points_;  // in the body's frame; of a sphere none
  Vector3d centre_;
  double radius_ = 0;  // of a sphere
};

}  // namespace grapnel
