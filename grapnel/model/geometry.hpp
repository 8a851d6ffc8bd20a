#pragma once

/// @file
/// Shapes of bodies, for clearance and for drawing. Thread safety: plain values; meshes are shared and immutable.
/// Public, kept stable.

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

// The convex hull of points, as clearance needs it.

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

// Shapes made of triangles.

/// Triangles in a frame of their own, in the unit of their file.
struct TriangleMesh {
  std::string name;  // of its file
  std::vector<Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;  // vertices, counter-clockwise seen from outside
  ConvexHull hull = {};                       // of the vertices: what clearance sees of it
};

/// A mesh with its hull. @throws std::invalid_argument if it has no triangle, if a triangle names a vertex that is not
/// there, or if the vertices are not finite or all in one plane.
std::shared_ptr<const TriangleMesh> make_triangle_mesh(std::string name, std::vector<Vector3d> vertices,
                                                       std::vector<std::array<int, 3>> triangles);

/// A shape centred on the frame X_BG of its body; of a mesh, X_BG is the frame of the file.
struct Geometry {
  enum class Shape { none, box, cylinder, capsule, sphere, mesh };
  Shape shape = Shape::none;
  /// box: edge lengths; cylinder: radius, length along z; capsule: radius, length along z between the centres of its
  /// end caps; sphere: radius [m]; mesh: what the file's numbers are multiplied with along each axis, into m.
  Vector3d size{0, 0, 0};
  Posed X_BG = Posed::identity();
  std::shared_ptr<const TriangleMesh> mesh = {};  // of shape mesh, never null there; copies of a problem share it
};

}  // namespace grapnel
