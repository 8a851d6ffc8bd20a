#pragma once

/// @file
/// Distance of two convex cores, and their penetration. For this module and contact/.

#include <algorithm>
#include <cmath>

#include "grapnel/contact/support_map.hpp"
#include "grapnel/model/geometry.hpp"

namespace grapnel {

// Shapes as a core with a rounding radius: a sphere is a point, a capsule a segment, both with a radius. Boxes and
// cylinders are their own cores; the core of a mesh is its convex hull. Points and segments are boxes with edges of
// length zero.

/// A convex set in its frame: a box; if round, a cylinder along z with radius half[0]; or a hull in such a box. Box,
/// cylinder and the hull's bounding box are centred on the frame's origin.
struct ConvexCore {
  Vector3d half = Vector3d::zero();  // half extents along the frame's axes [m]
  bool round = false;
  double rounding = 0;                // of the shape around the core [m]
  const ConvexHull* hull = nullptr;   // in the mesh's unit
  Vector3d scale = Vector3d::zero();  // of the hull, into m
  const SupportMap* map = nullptr;    // of the scaled hull; null: all vertices are searched

  bool is_segment() const { return !round && half[0] == 0 && half[1] == 0; }
  bool is_point() const { return is_segment() && half[2] == 0; }
  /// Radius of the core's bounding sphere [m].
  double reach() const { return round ? std::hypot(half[0], half[2]) : norm(half); }
  /// A vector of the hull's mesh, such as an edge, in the core's frame.
  Vector3d scaled(const Vector3d& v) const { return {scale[0] * v[0], scale[1] * v[1], scale[2] * v[2]}; }
  /// Direction of a normal of the hull, not of length 1.
  Vector3d scaled_normal(const Vector3d& n) const { return {n[0] / scale[0], n[1] / scale[1], n[2] / scale[2]}; }
  /// A point of the core.
  Vector3d any_point() const { return hull ? scaled(hull->vertices[0] - hull->center) : Vector3d::zero(); }
};

inline ConvexCore core_of(const Geometry& geometry) {
  const Vector3d& s = geometry.size;
  switch (geometry.shape) {
    case Geometry::Shape::box:
      return {0.5 * s, false, 0};
    case Geometry::Shape::cylinder:
      return {{s[0], s[0], 0.5 * s[1]}, true, 0};
    case Geometry::Shape::capsule:
      return {{0, 0, 0.5 * s[1]}, false, s[0]};
    case Geometry::Shape::sphere:
      return {{0, 0, 0}, false, s[0]};
    case Geometry::Shape::mesh: {
      const ConvexHull& hull = geometry.mesh->hull;
      return {{s[0] * hull.half[0], s[1] * hull.half[1], s[2] * hull.half[2]}, false, 0, &hull, s};
    }
    case Geometry::Shape::none:
      break;
  }
  return {};
}

/// Pose of a shape's core on its body.
inline Posed core_pose(const Geometry& geometry) {
  if (geometry.shape != Geometry::Shape::mesh) return geometry.X_BG;
  return {geometry.X_BG.R, geometry.X_BG * core_of(geometry).scaled(geometry.mesh->hull.center)};
}

/// Support point of the hull along a direction in the core's frame.
inline Vector3d hull_support(const ConvexCore& core, const Vector3d& direction) {
  const Vector3d d = core.scaled(direction);  // n . (S v) = (S n) . v
  const std::vector<Vector3d>& vertices = core.hull->vertices;
  std::size_t best = 0;
  double farthest = dot(d, vertices[0]);
  for (std::size_t i = 1; i < vertices.size(); ++i) {
    if (const double along = dot(d, vertices[i]); along > farthest) farthest = along, best = i;
  }
  return core.scaled(vertices[best] - core.hull->center);
}

/// Support point of the core along `direction` (of any length; both in the core's frame).
inline Vector3d support(const ConvexCore& core, const Vector3d& direction) {
  if (core.map) return core.map->support(direction);
  if (core.hull) return hull_support(core, direction);
  const double z = std::copysign(core.half[2], direction[2]);
  if (!core.round) {
    return {std::copysign(core.half[0], direction[0]), std::copysign(core.half[1], direction[1]), z};
  }
  const double radial = std::sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
  if (!(radial > 0)) return {0, 0, z};
  const double scale = core.half[0] / radial;
  return {scale * direction[0], scale * direction[1], z};
}

/// Two cores, the second one posed in the frame of the first: their Minkowski difference A - B.
struct CorePair {
  const ConvexCore& a;
  const ConvexCore& b;
  Posed X_AB;

  /// Length scale of rounding errors and tolerances [m].
  double scale() const { return a.reach() + b.reach() + norm(X_AB.p); }
  Vector3d support_a(const Vector3d& n) const { return support(a, n); }
  Vector3d support_b(const Vector3d& n) const { return X_AB * support(b, transposed_times(X_AB.R, n)); }
};

/// In the frame of the first core.
struct ConvexDistance {
  bool separated;    // false: the cores overlap or touch to rounding error, and only `difference` is valid
  Vector3d point_a;  // nearest points
  Vector3d point_b;
  Vector3d difference;  // point_a - point_b; its length is the distance [m]
};

/// The algorithm of Gilbert, Johnson and Keerthi (IEEE J. Robotics Autom. 4 (1988) 193-203). It ends when its lower
/// bound meets the distance to a relative 1e-14 or rounding error. The nearest point of the simplex is the best of
/// those on all its faces, because region tests are unreliable for thin simplices (cf. M. Montanari, N. Petrinic, E.
/// Barbieri, ACM Trans. Graphics 36 (2017) 30, the source of the barycentric coordinates by projection). Poses that are
/// not finite give results that are not finite. Does not throw or allocate.
ConvexDistance convex_distance(const CorePair& pair);

/// Nearest points of the segments from p1 to p2 and from q1 to q2, which may degenerate to points; exact also for
/// parallel and crossing segments.
ConvexDistance segment_distance(const Vector3d& p1, const Vector3d& p2, const Vector3d& q1, const Vector3d& q2);

// Penetration depth of two overlapping convex cores.

/// In the frame of the first core.
struct Penetration {
  double depth;      // [m]; negative if the cores are slightly separated
  Vector3d normal;   // unit; the second core translated by depth * normal touches the first
  Vector3d point_a;  // on the first core, point_a - point_b = depth * normal: the contact points after that translation
  Vector3d point_b;
};

/// The minimum penetration depth over all directions n, min h(n) with h the support function of the Minkowski
/// difference.
/// - Boxes, segments and points: exact, from the normals of its faces.
/// - A cylinder with one of those: every smooth part of the difference's surface is a face, or has a normal
/// perpendicular to a box edge or to the cylinder's axis. The minimum is found by one-dimensional searches of those
/// circles of directions.
/// - Two cylinders: the same, and a search of the whole sphere for touching rims.
/// - Hulls of meshes: as boxes while their faces and edges have few enough directions (4000 and 64), otherwise by a
/// search of the whole sphere.
///
/// Searches find a local minimum; the depth of cylinders and of hulls with many faces is therefore an upper bound.
/// Throws only if memory for hulls cannot be allocated; allocates for hulls only.
Penetration penetration(const CorePair& pair);

}  // namespace grapnel
