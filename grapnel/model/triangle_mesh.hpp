#pragma once

/// @file
/// Shapes made of triangles.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "grapnel/model/convex_hull.hpp"

namespace grapnel {

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

}  // namespace grapnel
