#pragma once

/// @file
/// The convex hull of points, as clearance needs it. Thread safety: pure function, plain values.

#include <span>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// A convex polyhedron.
struct ConvexHull {
  static constexpr std::size_t kMostEdges = 64;

  std::vector<Vector3d> vertices;  // of the given points those that span it; perhaps a few more on its surface
  std::vector<Vector3d> normals;   // unit, outward; of triangles in one plane once
  std::vector<double> offsets;     // per normal: how far its plane is from the center, along it
  std::vector<Vector3d> edges;  // unit, along its edges; of parallel ones once; empty if there are more than kMostEdges
  Vector3d center = Vector3d::zero();  // of the box along the axes that bounds it
  Vector3d half = Vector3d::zero();    // half of that box's edges

  bool is_empty() const { return normals.empty(); }
};

/// The hull of `points`; empty if they all lie in one plane, to 1e-9 of the box around them, or are not finite. No
/// point is outside of it by more than 1e-11 of that box. Quickhull (C. B. Barber, D. P. Dobkin, H. Huhdanpaa, ACM
/// Trans. Math. Softw. 22 (1996) 469-483) on a grid of 2^40 points across the box, on which the side of a plane is
/// decided exactly: it cannot go astray, whatever the points.
ConvexHull convex_hull(std::span<const Vector3d> points);

}  // namespace grapnel
