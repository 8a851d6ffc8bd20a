#include "grapnel/clearance/shape_distance.hpp"

#include <limits>

#include "grapnel/clearance/convex_distance.hpp"

namespace grapnel {

namespace {

// Distance, nearest points and normal of two cores in the frame of the first.
using CoreDistance = ShapeDistance;

// A unit vector that is perpendicular to d and e where these leave a choice.
Vector3d any_normal(const Vector3d& d, const Vector3d& e) {
  const Vector3d n = cross(d, e);
  if (const double length = norm(n); length > 1e-9 * norm(d) * norm(e)) return (1 / length) * n;
  const Vector3d& along = norm(d) > norm(e) ? d : e;
  for (int k = 0; k < 3; ++k) {
    const Vector3d side = cross(along, Vector3d::unit(k));
    if (const double length = norm(side); length > 0.5 * norm(along) && length > 0) return (1 / length) * side;
  }
  return {1, 0, 0};
}

CoreDistance segments(const CorePair& pair) {
  const Vector3d p{0, 0, pair.a.half[2]};
  const Vector3d q = pair.b.half[2] * pair.X_AB.R.column(2);
  const ConvexDistance found = segment_distance(-p, p, pair.X_AB.p - q, pair.X_AB.p + q);
  const double distance = norm(found.difference);
  // Crossing segments: a distance without a direction.
  const bool crossing = !(distance > 1e-14 * pair.scale());
  const Vector3d normal = crossing ? any_normal(p, q) : (-1 / distance) * found.difference;
  return {distance, found.point_a, found.point_b, normal};
}

// A hull and a point in its frame, which may be inside it.
CoreDistance hull_and_point(const ConvexCore& core, const Vector3d& point) {
  const ConvexCore one{};
  const ConvexDistance found = convex_distance({core, one, {Rotationd::identity(), point}});
  const double distance = norm(found.difference);
  if (found.separated && distance > 1e-9 * core.reach())
    return {distance, found.point_a, point, (-1 / distance) * found.difference};
  double least = std::numeric_limits<double>::infinity();
  Vector3d normal{1, 0, 0};
  // Scaled, a plane n . x = o is (n / s) . x = o.
  for (std::size_t k = 0; k < core.hull->normals.size(); ++k) {
    const Vector3d n = core.scaled_normal(core.hull->normals[k]);
    const double length = norm(n), depth = (core.hull->offsets[k] - dot(n, point)) / length;
    if (depth < least) least = depth, normal = (1 / length) * n;
  }
  return {-least, point + least * normal, point, normal};
}

// A core and a point in its frame, which may be inside it.
CoreDistance core_and_point(const ConvexCore& core, const Vector3d& point) {
  if (core.hull) return hull_and_point(core, point);
  // In cylindrical coordinates a cylinder is a rectangle; in each coordinate, the excess over the half extent.
  const double radius = std::hypot(point[0], point[1]);
  Vector3d outward[3], excess{-1, -1, -1};
  int count = 0;
  const auto direction = [&](const Vector3d& n, double along, double half) {
    outward[count] = n;
    excess[count++] = along - half;
  };
  if (core.round) {
    direction(radius > 0 ? Vector3d{point[0] / radius, point[1] / radius, 0} : Vector3d{1, 0, 0}, radius, core.half[0]);
    direction({0, 0, std::copysign(1.0, point[2])}, std::abs(point[2]), core.half[2]);
  } else {
    for (int k = 0; k < 3; ++k) {
      direction(std::copysign(1.0, point[k]) * Vector3d::unit(k), std::abs(point[k]), core.half[k]);
    }
  }
  Vector3d away = Vector3d::zero();
  int nearest = 0;
  for (int k = 0; k < count; ++k) {
    if (excess[k] > 0) away += excess[k] * outward[k];
    if (excess[k] > excess[nearest]) nearest = k;
  }
  // Outside: the excesses together; inside: the nearest surface.
  double distance = norm(away);
  Vector3d normal = outward[nearest];
  if (distance > 0) {
    normal = (1 / distance) * away;
  } else {
    distance = excess[nearest];
  }
  return {distance, point - distance * normal, point, normal};
}

CoreDistance reversed(const CoreDistance& d) { return {d.distance, d.point_b, d.point_a, -d.normal}; }

// Nearest points of cores that are apart, of which a cylinder's are not quite at their places yet: each in turn moves
// to the point of its core that is nearest to the other.
ConvexDistance sharpened(const CorePair& pair, ConvexDistance d) {
  const Posed X_BA = inverse(pair.X_AB);
  double square = dot(d.difference, d.difference);
  for (int step = 0; step < 20; ++step) {
    const Vector3d point_b = pair.X_AB * core_and_point(pair.b, X_BA * d.point_a).point_a;
    const Vector3d point_a = core_and_point(pair.a, point_b).point_a;
    const Vector3d difference = point_a - point_b;
    if (!(dot(difference, difference) < square)) break;
    square = dot(difference, difference);
    d = {true, point_a, point_b, difference};
  }
  return d;
}

CoreDistance general(const CorePair& pair) {
  ConvexDistance found = convex_distance(pair);
  if (found.separated && (pair.a.round || pair.b.round)) found = sharpened(pair, found);
  const double distance = norm(found.difference);
  // So near to touching the difference of the points has lost its direction; the search of directions has not.
  if (found.separated && distance > 1e-9 * pair.scale()) {
    return {distance, found.point_a, found.point_b, (-1 / distance) * found.difference};
  }
  const Penetration overlap = penetration(pair);
  return {-overlap.depth, overlap.point_a, overlap.point_b, overlap.normal};
}

CoreDistance core_distance(const CorePair& pair) {
  if (pair.a.is_segment() && pair.b.is_segment()) return segments(pair);
  if (pair.b.is_point()) return core_and_point(pair.a, pair.X_AB.p);
  if (pair.a.is_point()) {
    const CoreDistance d = core_and_point(pair.b, inverse(pair.X_AB).p);
    return reversed({d.distance, pair.X_AB * d.point_a, Vector3d::zero(), pair.X_AB.R * d.normal});
  }
  return general(pair);
}

}  // namespace

ShapeDistance shape_distance(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB) {
  if (a.shape == Geometry::Shape::none || b.shape == Geometry::Shape::none) {
    return {std::numeric_limits<double>::infinity(), X_WA.p, X_WB.p, {1, 0, 0}};
  }
  const Posed X_WG = X_WA * core_pose(a);
  const ConvexCore core_a = core_of(a), core_b = core_of(b);
  const CoreDistance d = core_distance({core_a, core_b, inverse(X_WG) * (X_WB * core_pose(b))});
  return {d.distance - core_a.rounding - core_b.rounding, X_WG * (d.point_a + core_a.rounding * d.normal),
          X_WG * (d.point_b - core_b.rounding * d.normal), X_WG.R * d.normal};
}

}  // namespace grapnel
