#pragma once

/// @file
/// Pairs of shapes of every kind, in random poses with a given overlap.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

enum class CaseShape { sphere, capsule, cylinder, box, hull, round_hull, half_space };
inline constexpr CaseShape kCaseShapes[] = {CaseShape::sphere,    CaseShape::capsule, CaseShape::cylinder,
                                            CaseShape::box,       CaseShape::hull,    CaseShape::round_hull,
                                            CaseShape::half_space};
inline const char* name_of(CaseShape s) {
  const char* names[] = {"sphere", "capsule", "cylinder", "box", "hull", "round_hull", "half_space"};
  return names[static_cast<int>(s)];
}

inline Geometry primitive(Geometry::Shape shape, const Vector3d& size) {
  Geometry g;
  g.shape = shape, g.size = size;
  return g;
}
inline Geometry hull_geometry(const std::vector<Vector3d>& points) {
  Geometry g;
  g.shape = Geometry::Shape::mesh, g.size = {1, 1, 1};
  g.mesh = make_triangle_mesh("points", points, {{0, 1, 2}});
  return g;
}
/// A hull of `count` points on an ellipsoid with semi-axes between 0.5 and 1 of `size`.
inline Geometry ellipsoid_hull(int count, double size, Random& random) {
  const Vector3d axes{size * random.uniform(0.5, 1), size * random.uniform(0.5, 1), size * random.uniform(0.5, 1)};
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const Vector3d n = random.direction();
    points.push_back({axes[0] * n[0], axes[1] * n[1], axes[2] * n[2]});
  }
  return hull_geometry(points);
}

/// Between 0.1 m and 0.3 m large, in a random pose on its body.
inline ContactShape random_contact_shape(CaseShape shape, Random& random) {
  const auto size = [&] { return random.uniform(0.1, 0.3); };
  Posed X_BG{random.rotation(), random.vector(0.1)};
  if (shape == CaseShape::half_space) return ContactShape::half_space(X_BG);
  Geometry g;
  switch (shape) {
    case CaseShape::sphere:
      g = primitive(Geometry::Shape::sphere, {size(), 0, 0});
      break;
    case CaseShape::capsule:
      g = primitive(Geometry::Shape::capsule, {0.5 * size(), 2 * size(), 0});
      break;
    case CaseShape::cylinder:
      g = primitive(Geometry::Shape::cylinder, {size(), 2 * size(), 0});
      break;
    case CaseShape::box:
      g = primitive(Geometry::Shape::box, {size(), size(), size()});
      break;
    default:
      g = ellipsoid_hull(shape == CaseShape::hull ? 12 : 1000, 0.3, random);
      break;
  }
  g.X_BG = X_BG;
  return ContactShape(g);
}

/// Elastic only, of 1e7 Pa and 2e7 Pa.
inline ContactLaw elastic_law(bool hertz = true) {
  ContactMaterial a, b;
  (hertz ? a.modulus : a.stiffness) = hertz ? 1e7 : 1e5;
  (hertz ? b.modulus : b.stiffness) = hertz ? 2e7 : 3e5;
  return combine(a, b);
}

/// B with an orientation, on a line through both shapes' centres where the shapes touch; a half-space moves along its
/// normal instead.
inline Posed touching_pose(const PairContact& pair, const ContactShape& a, const ContactShape& b, const Posed& X_WA,
                           const Rotationd& R_WB, const Vector3d& direction) {
  Posed X_WB{R_WB, Vector3d::zero()};
  const Vector3d start = X_WA * a.X_BC().p - X_WB.R * b.X_BC().p;
  if (b.kind() == ContactShape::Kind::half_space) {
    X_WB.p = start;
    const ShapeSeparation s = pair.separation(X_WA, X_WB);
    X_WB.p -= s.distance * s.normal;
    return X_WB;
  }
  X_WB.p = start + 5.0 * direction;
  // The distance is a convex function along the line: Newton's iteration. It ends before the shapes overlap, where the
  // depth takes longer.
  for (int i = 0; i < 100; ++i) {
    const ShapeSeparation s = pair.separation(X_WA, X_WB);
    if (s.distance < 1e-9) break;
    X_WB.p -= ((1 - 1e-5) * s.distance / dot(direction, s.normal)) * direction;
  }
  return X_WB;
}

/// A pose of B at which the pair overlaps by about `depth`, approached along a random line.
inline Posed overlapping_pose(const ContactShape& a, const ContactShape& b, const Posed& X_WA, double depth,
                              Random& random) {
  const PairContact pair(a, b, elastic_law());
  const Rotationd R_WB = random.rotation();
  Posed X_WB = touching_pose(pair, a, b, X_WA, R_WB, random.direction());
  const ShapeSeparation s = pair.separation(X_WA, X_WB);
  X_WB.p -= (s.distance + depth) * s.normal;
  return X_WB;
}

/// The pose after the motion with a constant twist at its origin, in W, for the time t.
inline Posed moved(const Posed& X, const Twistd& V, double t) {
  const double rate = norm(V.angular);
  Posed Y{X.R, X.p + t * V.linear};
  if (rate > 0) Y.R = rotation_about((1 / rate) * V.angular, rate * t) * X.R;
  return Y;
}

}  // namespace grapnel::testing
