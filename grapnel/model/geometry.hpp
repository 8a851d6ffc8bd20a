#pragma once

/// @file
/// Primitive shapes of bodies, for clearance and for drawing. Thread safety: plain values.

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// A primitive shape centred on the frame X_BG of its body.
struct Geometry {
  enum class Shape { none, box, cylinder, capsule, sphere };
  Shape shape = Shape::none;
  /// box: edge lengths; cylinder: radius, length along z; capsule: radius, length along z between the centres of its
  /// end caps; sphere: radius [m].
  Vector3d size{0, 0, 0};
  Posed X_BG = Posed::identity();
};

}  // namespace grapnel
