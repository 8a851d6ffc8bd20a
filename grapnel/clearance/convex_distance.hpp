#pragma once

/// @file
/// Distance of two convex cores that do not overlap. Inside this module only.

#include "grapnel/clearance/convex_core.hpp"

namespace grapnel {

/// In the frame of the first core.
struct ConvexDistance {
  bool separated;    // false: the cores overlap or touch to rounding, and only `difference` is meant
  Vector3d point_a;  // nearest points
  Vector3d point_b;
  Vector3d difference;  // point_a - point_b; its length is the distance [m]
};

/// The algorithm of Gilbert, Johnson and Keerthi (IEEE J. Robotics Autom. 4 (1988) 193-203), which ends when its lower
/// bound meets the distance to a relative 1e-14 or rounding. The nearest point of the simplex is the best of those on
/// all its faces rather than chosen by a test of regions, which thin simplices mislead (cf. M. Montanari, N. Petrinic,
/// E. Barbieri, ACM Trans. Graphics 36 (2017) 30, from where the barycentric coordinates by projection are). Poses that
/// are not finite give numbers that are not finite. Throws nothing, allocates nothing.
ConvexDistance convex_distance(const CorePair& pair);

/// Nearest points of the segments from p1 to p2 and from q1 to q2, which may be points: exact also where they are
/// parallel or cross.
ConvexDistance segment_distance(const Vector3d& p1, const Vector3d& p2, const Vector3d& q1, const Vector3d& q2);

}  // namespace grapnel
