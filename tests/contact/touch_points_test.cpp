/// The points at which two shapes touch.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact/contact_cases.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace touch_points_test {

using Shape = Geometry::Shape;

TouchPoints touch_of(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB) {
  return PairContact(ContactShape(a), ContactShape(b), elastic_law()).touch(X_WA, X_WB);
}
TouchPoints touch_on_floor(const Geometry& a, const Posed& X_WA) {
  const ContactShape floor = ContactShape::half_space(Posed::identity());
  return PairContact(ContactShape(a), floor, elastic_law()).touch(X_WA, Posed::identity());
}
Posed at(const Vector3d& p, const Rotationd& R = Rotationd::identity()) { return {R, p}; }

// Whether the points are these, in any order.
void expect_points(const TouchPoints& touch, const std::vector<Vector3d>& expected) {
  EXPECT_EQ(touch.points.size(), expected.size());
  for (const Vector3d& e : expected) {
    const auto is_this = [&](const Vector3d& p) { return norm(p - e) < 1e-12; };
    EXPECT_TRUE(std::any_of(touch.points.begin(), touch.points.end(), is_this)) << e[0] << " " << e[1] << " " << e[2];
  }
}

TEST(TouchPoints, OnAFloor) {
  const TouchPoints ball = touch_on_floor(primitive(Shape::sphere, {0.1, 0, 0}), at({1, 2, 0.1}));
  expect_points(ball, {{1, 2, 0}});
  EXPECT_LT(norm(ball.normal - Vector3d{0, 0, -1}), 1e-15);
  const Geometry box = primitive(Shape::box, {0.2, 0.4, 0.6});
  expect_points(touch_on_floor(box, at({0, 0, 0.3})), {{0.1, 0.2, 0}, {0.1, -0.2, 0}, {-0.1, 0.2, 0}, {-0.1, -0.2, 0}});
  const double c = std::cos(0.3), s = std::sin(0.3);
  expect_points(touch_on_floor(box, at({0, 0, 0.1 * s + 0.3 * c}, rotation_about({0, 1, 0}, 0.3))),
                {{0.1 * c - 0.3 * s, 0.2, 0}, {0.1 * c - 0.3 * s, -0.2, 0}});
  const Rotationd lying = rotation_about({0, 1, 0}, M_PI / 2);
  expect_points(touch_on_floor(primitive(Shape::capsule, {0.1, 0.5, 0}), at({0, 0, 0.1}, lying)),
                {{0.25, 0, 0}, {-0.25, 0, 0}});
  const Geometry cylinder = primitive(Shape::cylinder, {0.1, 0.5, 0});
  expect_points(touch_on_floor(cylinder, at({0, 0, 0.1}, lying)), {{0.25, 0, 0}, {-0.25, 0, 0}});
  const TouchPoints standing = touch_on_floor(cylinder, at({0, 0, 0.25}));
  ASSERT_EQ(standing.points.size(), 4U);
  Vector3d sum = Vector3d::zero();
  for (const Vector3d& p : standing.points) {
    EXPECT_NEAR(std::hypot(p[0], p[1]), 0.1, 1e-14);
    sum += p;
  }
  EXPECT_LT(norm(sum), 1e-14);  // they surround the axis
}

TEST(TouchPoints, OfTwoBoxes) {
  const Geometry a = primitive(Shape::box, {1, 0.2, 0.2}), b = primitive(Shape::box, {0.2, 1, 0.2});
  const TouchPoints faces = touch_of(a, at({0, 0, 0}), b, at({0.1, 0, 0.2}));
  expect_points(faces, {{0, 0.1, 0.1}, {0, -0.1, 0.1}, {0.2, 0.1, 0.1}, {0.2, -0.1, 0.1}});
  EXPECT_LT(norm(faces.normal - Vector3d{0, 0, 1}), 1e-14);
  // The same shapes in the other order, and overlapping to rounding error.
  const TouchPoints reversed = touch_of(b, at({0.1, 0, 0.2 - 1e-13}), a, at({0, 0, 0}));
  EXPECT_EQ(reversed.points.size(), 4U);
  EXPECT_LT(norm(reversed.normal - Vector3d{0, 0, -1}), 1e-12);
  // Crossing edges, then a corner on a face.
  const double up = 0.1 * std::sqrt(2.0);
  const TouchPoints edges = touch_of(a, at({0, 0, 0}, rotation_about({1, 0, 0}, M_PI / 4)), b,
                                     at({0.03, 0.02, 2 * up}, rotation_about({0, 1, 0}, M_PI / 4)));
  expect_points(edges, {{0.03, 0, up}});
  const Rotationd tilted = rotation_between(Vector3d{1, 1, 1} * (1 / std::sqrt(3.0)), {0, 0, -1});
  const Geometry cube = primitive(Shape::box, {0.2, 0.2, 0.2}), table = primitive(Shape::box, {1, 1, 0.2});
  expect_points(touch_of(table, at({0, 0, 0}), cube, at({0.2, 0.1, 0.1 + 0.1 * std::sqrt(3.0)}, tilted)),
                {{0.2, 0.1, 0.1}});
}

// Of random pairs in touching poses: every point is on both surfaces, and the normal is that of the nearest points.
TEST(TouchPoints, AreOnBothSurfaces) {
  Worst distance("distance of touching points from a surface [m]"), normal("normal against that of nearest points");
  for (int k = 0; k < test::repetitions(300); ++k) {
    Random random(k);
    const CaseShape kind_a = kCaseShapes[random.integer(0, 5)], kind_b = kCaseShapes[random.integer(0, 6)];
    const ContactShape a = random_contact_shape(kind_a, random), b = random_contact_shape(kind_b, random);
    const PairContact pair(a, b, elastic_law());
    const Posed X_WA{random.rotation(), random.vector(1)};
    const Posed X_WB = touching_pose(pair, a, b, X_WA, random.rotation(), random.direction());
    if (pair.gap(X_WA, X_WB) < -1e-8) continue;  // prisms, which are larger than their cylinders
    const TouchPoints touch = pair.touch(X_WA, X_WB);
    ASSERT_FALSE(touch.points.empty());
    normal.note(norm(touch.normal - pair.separation(X_WA, X_WB).normal), k);
    for (const Vector3d& p : touch.points) {
      distance.note(std::abs(a.distance(inverse(a.X_BC()) * (inverse(X_WA) * p)).distance - a.core().rounding), k);
      if (b.kind() != ContactShape::Kind::half_space)
        distance.note(std::abs(b.distance(inverse(b.X_BC()) * (inverse(X_WB) * p)).distance - b.core().rounding), k);
    }
  }
  EXPECT_LT(distance.value(), 1e-7);
  EXPECT_LT(normal.value(), 1e-5);
}

}  // namespace touch_points_test
}  // namespace grapnel::testing
