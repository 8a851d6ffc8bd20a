#pragma once

/// @file
/// The points at which two convex shapes touch: the corners of the region that both have in common with their tangent
/// plane. Private to this module.

#include <vector>

#include "grapnel/contact/convex_distance.hpp"

namespace grapnel {

/// In the frame of the first core.
struct TouchPoints {
  Vector3d normal;  // unit, from the first shape to the second
  /// One point; two ends of a line; or at most four corners of a face. Halfway between both surfaces [m].
  std::vector<Vector3d> points;
};

/// Corners of faces within this distance of the tangent plane belong to the contact [m].
inline constexpr double kTouchTolerance = 1e-9;

/// Of two cores with their roundings, whose surfaces are within about kTouchTolerance of each other, or overlap.
TouchPoints touch_points(const CorePair& pair);
/// Of a core with its rounding and the half-space whose plane is that of X_AB's x and y axes, with z outward.
TouchPoints touch_points_on_plane(const ConvexCore& a, const Posed& X_AB);

}  // namespace grapnel
