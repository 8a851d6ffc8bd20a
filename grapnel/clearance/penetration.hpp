#pragma once

/// @file
/// How far two overlapping convex cores reach into each other. Inside this module only.

#include "grapnel/clearance/convex_core.hpp"

namespace grapnel {

/// In the frame of the first core.
struct Penetration {
  double depth;      // [m]; negative where the cores turn out to be just apart
  Vector3d normal;   // unit; the second core moved by depth * normal just touches the first
  Vector3d point_a;  // on the first core, point_a - point_b = depth * normal: where they would touch
  Vector3d point_b;
};

/// The least depth along any direction n, min h(n) with h the support function of the Minkowski difference. Boxes,
/// segments and points: exact, by the normals of its faces. A cylinder with one of those: every smooth part of the
/// difference's surface has a normal perpendicular to a box's edge or to the cylinder's axis, or is a face, so the
/// least is found by one-dimensional searches of those circles of directions. Two cylinders: those, and a search of the
/// whole sphere for touching rims. Hulls of meshes as boxes while their faces and edges have few enough directions
/// (4000 and 64), else by a search of the whole sphere. Searches find a local minimum, so that the depth of cylinders
/// and of hulls with many faces is an upper bound. Throws nothing but what memory for hulls may; allocates for hulls
/// only.
Penetration penetration(const CorePair& pair);

}  // namespace grapnel
