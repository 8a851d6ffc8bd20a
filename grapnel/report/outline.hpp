#pragma once

/// @file
/// Outlines of bodies as seen from far away.

#include <array>
#include <string>
#include <vector>

#include "grapnel/report/drawn_shape.hpp"

namespace grapnel {

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
