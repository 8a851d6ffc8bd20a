#pragma once

/// @file
/// What a body is drawn as, and triangles of it: for pictures and for glTF.

#include <array>
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

}  // namespace grapnel
