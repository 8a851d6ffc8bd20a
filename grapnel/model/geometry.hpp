#pragma once

/// @file
/// Shapes of bodies, for clearance and visualization. Thread safety: plain values; meshes are shared and immutable.
/// Public, kept stable.

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

// Convex hull of points, for clearance.

/// A convex polyhedron.
struct ConvexHull {
  static constexpr std::size_t kMostEdges = 64;

  std::vector<Vector3d> vertices;      // those of the given points that span it; possibly a few more on its surface
  std::vector<Vector3d> normals;       // unit, outward; one per plane
  std::vector<double> offsets;         // per normal: distance of its plane from the center, along it
  std::vector<Vector3d> edges;         // unit, along its edges; one per direction; empty for more than kMostEdges
  Vector3d center = Vector3d::zero();  // of the axis-aligned bounding box
  Vector3d half = Vector3d::zero();    // half edge lengths of that box

  bool is_empty() const { return normals.empty(); }
};

/// The hull of `points`; empty if they are coplanar, to 1e-9 of their bounding box, or not finite. No point is outside
/// by more than 1e-11 of that box. Quickhull (C. B. Barber, D. P. Dobkin, H. Huhdanpaa, ACM Trans. Math. Softw. 22
/// (1996) 469-483) on a grid of 2^40 points across the box. On the grid the side of a plane is decided exactly, so the
/// algorithm is robust for all inputs.
ConvexHull convex_hull(std::span<const Vector3d> points);

// Triangle meshes.

/// Triangles in the mesh's frame, in the unit of their file.
struct TriangleMesh {
  std::string name;  // of the file
  std::vector<Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;  // vertex indices, counter-clockwise seen from outside
  ConvexHull hull = {};                       // of the vertices; used for clearance
};

/// A mesh with its hull. @throws std::invalid_argument if it has no triangle, if a triangle refers to a missing vertex,
/// or if the vertices are not finite or coplanar.
std::shared_ptr<const TriangleMesh> make_triangle_mesh(std::string name, std::vector<Vector3d> vertices,
                                                       std::vector<std::array<int, 3>> triangles);

/// A shape centred on the frame X_BG of its body; for a mesh, X_BG is the frame of the file.
struct Geometry {
  enum class Shape { none, box, cylinder, capsule, sphere, mesh };
  Shape shape = Shape::none;
  /// box: edge lengths; cylinder: radius, length along z; capsule: radius, length along z between the centres of its
  /// end caps; sphere: radius [m]; mesh: scale factors along each axis from the file's unit to m.
  Vector3d size{0, 0, 0};
  Posed X_BG = Posed::identity();
  std::shared_ptr<const TriangleMesh> mesh = {};  // for shape mesh, never null there; shared by copies of a problem
};

}  // namespace grapnel
