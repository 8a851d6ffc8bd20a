#pragma once

/// @file
/// Random primitive shapes, with support functions written from their definitions.

#include <cmath>

#include "grapnel/model/geometry.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

using Shape = Geometry::Shape;
inline constexpr Shape kShapes[] = {Shape::box, Shape::cylinder, Shape::capsule, Shape::sphere};
inline const char* shape_name(Shape shape) {
  const char* names[] = {"none", "box", "cylinder", "capsule", "sphere"};
  return names[static_cast<int>(shape)];
}

/// Sizes within [least, most] [m], evenly on a logarithmic scale; centred on the body's frame.
inline Geometry random_shape(Shape shape, double min_size, double max_size, Random& random) {
  Geometry g;
  g.shape = shape;
  for (int k = 0; k < 3; ++k) g.size[k] = random.log_uniform(min_size, max_size);
  return g;
}

/// Radius of a sphere about the shape's centre that contains the shape [m].
inline double reach(const Geometry& g) {
  const Vector3d& s = g.size;
  switch (g.shape) {
    case Shape::box:
      return 0.5 * norm(s);
    case Shape::cylinder:
      return std::hypot(s[0], 0.5 * s[1]);
    case Shape::capsule:
      return s[0] + 0.5 * s[1];
    default:
      return s[0];
  }
}

/// Extent of the shape from its centre along the unit vector n (in its frame) [m].
inline double extent(const Geometry& g, const Vector3d& n) {
  const Vector3d& s = g.size;
  switch (g.shape) {
    case Shape::box:
      return 0.5 * (std::abs(n[0]) * s[0] + std::abs(n[1]) * s[1] + std::abs(n[2]) * s[2]);
    case Shape::cylinder:
      return s[0] * std::hypot(n[0], n[1]) + 0.5 * s[1] * std::abs(n[2]);
    case Shape::capsule:
      return s[0] + 0.5 * s[1] * std::abs(n[2]);
    default:
      return s[0];
  }
}

/// Depth of the point inside the shape [m]; negative outside, where only the sign is meaningful.
inline double inside(const Geometry& g, const Vector3d& p) {
  const Vector3d& s = g.size;
  switch (g.shape) {
    case Shape::box:
      return std::min({0.5 * s[0] - std::abs(p[0]), 0.5 * s[1] - std::abs(p[1]), 0.5 * s[2] - std::abs(p[2])});
    case Shape::cylinder:
      return std::min(s[0] - std::hypot(p[0], p[1]), 0.5 * s[1] - std::abs(p[2]));
    case Shape::capsule:
      return s[0] - std::hypot(p[0], p[1], std::max(std::abs(p[2]) - 0.5 * s[1], 0.0));
    default:
      return s[0] - norm(p);
  }
}

/// A random point among those farthest along n (in the shape's frame): a vertex, or any of an edge or a face.
inline Vector3d farthest(const Geometry& g, const Vector3d& n, Random& random) {
  const Vector3d& s = g.size;
  const auto along = [&](double component, double half) {
    return std::abs(component) < 1e-14 ? random.uniform(-half, half) : std::copysign(half, component);
  };
  switch (g.shape) {
    case Shape::box:
      return {along(n[0], 0.5 * s[0]), along(n[1], 0.5 * s[1]), along(n[2], 0.5 * s[2])};
    case Shape::cylinder: {
      const double radial = std::hypot(n[0], n[1]), z = along(n[2], 0.5 * s[1]);
      if (radial > 1e-14) return {s[0] * n[0] / radial, s[0] * n[1] / radial, z};
      const double angle = random.uniform(-M_PI, M_PI), r = s[0] * random.uniform(0, 1);
      return {r * std::cos(angle), r * std::sin(angle), z};
    }
    case Shape::capsule:
      return Vector3d{0, 0, along(n[2], 0.5 * s[1])} + s[0] * n;
    default:
      return s[0] * n;
  }
}

/// A unit vector, often along or perpendicular to the coordinate axes, where the farthest points are faces and edges.
inline Vector3d random_normal(Random& random) {
  const int k = random.integer(0, 2);
  if (random.chance(0.25)) return random.chance(0.5) ? Vector3d::unit(k) : -Vector3d::unit(k);
  Vector3d n = random.direction();
  if (random.chance(0.33)) {
    n[k] = 0;
    n *= 1 / norm(n);
  }
  return n;
}

/// Two shapes with a known distance by construction: B's farthest point along -n lies `gap` beyond A's farthest point
/// along n.
struct KnownPair {
  Geometry a, b;
  Posed X_WA, X_WB;
  double gap;
  double scale;  // sizes and gap together [m]
};
inline KnownPair known_pair(Shape shape_a, Shape shape_b, double min_size, double max_size, double gap,
                            Random& random) {
  KnownPair k{random_shape(shape_a, min_size, max_size, random),
              random_shape(shape_b, min_size, max_size, random),
              {},
              {},
              gap,
              0};
  const Vector3d n_A = random_normal(random), n_B = random_normal(random);
  k.X_WA = {random.rotation(), random.vector(max_size)};
  const Vector3d n_W = k.X_WA.R * n_A;
  k.X_WB.R = rotation_between(n_B, -n_W) * rotation_about(n_B, random.uniform(-M_PI, M_PI));
  const Vector3d point_a = k.X_WA * farthest(k.a, n_A, random);
  k.X_WB.p = point_a + gap * n_W - k.X_WB.R * farthest(k.b, n_B, random);
  k.scale = reach(k.a) + reach(k.b) + std::abs(gap) + max_size;
  return k;
}

/// Any pose with the position within +-size.
inline Posed random_pose(double size, Random& random) { return {random.rotation(), random.vector(size)}; }

}  // namespace grapnel::testing
