#pragma once

/// @file
/// Shapes of bodies, for clearance and for drawing. Thread safety: plain values; meshes are shared and immutable.

#include <memory>

#include "grapnel/model/triangle_mesh.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {

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
