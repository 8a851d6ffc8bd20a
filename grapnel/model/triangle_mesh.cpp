#include "grapnel/model/triangle_mesh.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace grapnel {

std::shared_ptr<const TriangleMesh> make_triangle_mesh(std::string name, std::vector<Vector3d> vertices,
                                                       std::vector<std::array<int, 3>> triangles) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("mesh '{}': {}", name, why));
  };
  if (triangles.empty()) refuse("there is no triangle");
  for (const auto& triangle : triangles) {
    for (const int v : triangle) {
      if (v < 0 || v >= static_cast<int>(vertices.size())) refuse(fmt::format("there is no vertex {}", v));
    }
  }
  ConvexHull hull = convex_hull(vertices);
  if (hull.is_empty()) refuse("its vertices are not finite or all in one plane");
  return std::make_shared<const TriangleMesh>(
      TriangleMesh{std::move(name), std::move(vertices), std::move(triangles), std::move(hull)});
}

}  // namespace grapnel
