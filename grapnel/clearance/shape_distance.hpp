#pragma once

/// @file
/// Signed distance of two shapes.

#include "grapnel/model/geometry.hpp"

namespace grapnel {

/// How near two shapes are. Points and the normal are in W.
struct ShapeDistance {
  double distance;   // [m]; negative: they overlap, and this is the depth
  Vector3d point_a;  // on the surface of the first shape, nearest to the second one
  Vector3d point_b;  // point_b - point_a = distance * normal
  Vector3d normal;   // unit, from the first shape to the second
};

/// Signed distance of two shapes whose bodies are at X_WA and X_WB (Geometry::X_BG places the shape on its body).
///
/// Apart: the distance and a pair of nearest points (one of many where faces are parallel), exact to rounding, a few
/// 1e-15 of the scene's size; a cylinder with a box or a cylinder to about 1e-10 of it. Overlapping: minus the depth,
/// the least translation that parts the shapes, along the normal. It is exact for spheres, capsules and boxes with each
/// other and for cylinders with spheres. For cylinders with other shapes it is found by searches: always a translation
/// that parts them, and in all tests the least one, but that it is the least is not proved.
/// The sign is right where the shapes are not within 1e-8 of their size of touching. Centres that coincide and other
/// ambiguous cases give one of the equally good normals.
/// A mesh counts as its convex hull: never farther than the mesh itself. Its depth is exact as a box's while the hull's
/// faces and edges have few directions (4000 and 64), else an upper bound as a cylinder's.
/// A shape `none` is infinitely far. Poses that are not finite give a distance that is not finite. Throws nothing,
/// allocates nothing, but for meshes that overlap something.
ShapeDistance shape_distance(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB);

}  // namespace grapnel
