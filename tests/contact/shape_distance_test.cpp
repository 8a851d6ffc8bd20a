// Distances of separated shapes: placed at a known distance, and proved optimal by a separating plane.
#include "grapnel/contact/clearance_model.hpp"

#include <gtest/gtest.h>

#include "contact/random_shape.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace shape_distance_test {

using namespace testing;

constexpr int kCases = 100'000;

class ShapePair : public ::testing::TestWithParam<std::tuple<Shape, Shape>> {
 protected:
  Shape a() const { return std::get<0>(GetParam()); }
  Shape b() const { return std::get<1>(GetParam()); }
  std::string names() const { return std::string(shape_name(a())) + " and " + shape_name(b()); }
};
INSTANTIATE_TEST_SUITE_P(, ShapePair, ::testing::Combine(::testing::ValuesIn(kShapes), ::testing::ValuesIn(kShapes)),
                         [](const auto& i) {
                           return std::string(shape_name(std::get<0>(i.param))) + "_" +
                                  shape_name(std::get<1>(i.param));
                         });

// Checks every result: points on the surfaces, at the distance along the normal.
void check_points(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB, const ShapeDistance& d,
                  double tolerance) {
  ASSERT_NEAR(norm(d.normal), 1, 1e-12);
  ASSERT_LT(norm(d.point_b - d.point_a - d.distance * d.normal), tolerance);
  ASSERT_GT(inside(a, inverse(X_WA) * d.point_a), -tolerance);
  ASSERT_GT(inside(b, inverse(X_WB) * d.point_b), -tolerance);
}

// The gap between the planes normal to n that touch the shapes: at most the distance, for any n.
double plane_gap(const Geometry& a, const Posed& X_WA, const Geometry& b, const Posed& X_WB, const Vector3d& n) {
  return dot(n, X_WB.p - X_WA.p) - extent(a, transposed_times(X_WA.R, n)) - extent(b, transposed_times(X_WB.R, n));
}

TEST_P(ShapePair, FindsTheGivenDistance) {
  Random random(1);
  Worst error("distance of " + names() + " [m]"), bound("separating plane [m]");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double gap = random.chance(0.5) ? random.uniform(0, 2) : random.log_uniform(1e-6, 1);
    const KnownPair k = known_pair(a(), b(), 0.03, 1, gap, random);
    const ShapeDistance d = shape_distance(k.a, k.X_WA, k.b, k.X_WB);
    // Shapes of 3 cm to 1 m.
    ASSERT_LT(error.note(std::abs(d.distance - gap), i),
              1e-7);  // measured 9e-15; cylinder and box 2.3e-9 over 25 seeds
    // A lower bound from separating planes, independent of the placement; less accurate because it uses the computed
    // normal.
    if (gap > 1e-3) {
      // measured 3e-15; with a cylinder 3.2e-6 over 25 seeds
      ASSERT_LT(bound.note(std::abs(d.distance - plane_gap(k.a, k.X_WA, k.b, k.X_WB, d.normal)), i), 3e-5);
    }
    ASSERT_NO_FATAL_FAILURE(check_points(k.a, k.X_WA, k.b, k.X_WB, d, 1e-9));
  }
}

TEST_P(ShapePair, TinyAndHugeShapes) {
  Random random(2);
  Worst error("relative distance of " + names() + " from 1 mm to 100 m");
  for (int i = 0; i < kCases / 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    const KnownPair k = known_pair(a(), b(), 1e-3, 1e2, random.log_uniform(1e-4, 1e2), random);
    const ShapeDistance d = shape_distance(k.a, k.X_WA, k.b, k.X_WB);
    ASSERT_LT(error.note(std::abs(d.distance - k.gap) / k.scale, i), 1e-7);  // measured 1.2e-15; cylinder and box 9e-10
    ASSERT_NO_FATAL_FAILURE(check_points(k.a, k.X_WA, k.b, k.X_WB, d, 1e-9 * k.scale));
  }
}

TEST_P(ShapePair, TouchingAndBarelyOverlapping) {
  Random random(3);
  Worst error("signed distance near touching of " + names() + " [m]");
  for (int i = 0; i < kCases / 10; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double gap = random.chance(0.2) ? 0 : random.log_uniform(1e-12, 1e-5);
    const KnownPair k = known_pair(a(), b(), 0.1, 1, gap, random);
    const ShapeDistance d = shape_distance(k.a, k.X_WA, k.b, k.X_WB);
    // Below 1e-9 of the sizes, the penetration depth along sampled directions replaces the distance; at corners it is
    // slightly smaller.
    ASSERT_LT(error.note(std::abs(d.distance - gap), i), 5e-7);  // measured 4.7e-8 over 25 seeds
    // For slight overlap, the reported distance may be positive by at most the same amount.
    const KnownPair o = known_pair(a(), b(), 0.1, 1, -gap, random);
    const ShapeDistance overlap = shape_distance(o.a, o.X_WA, o.b, o.X_WB);
    ASSERT_LT(overlap.distance, 5e-7);
    ASSERT_GT(overlap.distance, -gap - 5e-7);  // measured 6.5e-9 below, two cylinders
    ASSERT_NO_FATAL_FAILURE(check_points(o.a, o.X_WA, o.b, o.X_WB, overlap, 1e-6));
  }
}

TEST_P(ShapePair, IsIndependentOfOrderAndFrame) {
  Random random(4);
  Worst order("order of " + names() + " [m]"), frame("frame of " + names() + " [m]");
  for (int i = 0; i < kCases / 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Geometry a_shape = random_shape(a(), 0.1, 1, random), b_shape = random_shape(b(), 0.1, 1, random);
    const Posed X_WA = random_pose(1, random), X_WB = random_pose(1, random), X_VW = random_pose(10, random);
    const ShapeDistance d = shape_distance(a_shape, X_WA, b_shape, X_WB);
    const ShapeDistance swapped = shape_distance(b_shape, X_WB, a_shape, X_WA);
    const ShapeDistance moved = shape_distance(a_shape, X_VW * X_WA, b_shape, X_VW * X_WB);
    // Depths of cylinders are found by searches with different initial guesses.
    const double tolerance = d.distance > 0 ? 1e-8 : 1e-3;
    // measured 3e-13 and 3e-14
    ASSERT_LT(order.note(std::abs(swapped.distance - d.distance), i), tolerance);
    ASSERT_LT(frame.note(std::abs(moved.distance - d.distance), i), tolerance);
  }
}

TEST_P(ShapePair, ShapesMoveWithTheirBodies) {
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    Geometry a_shape = random_shape(a(), 0.1, 1, random), b_shape = random_shape(b(), 0.1, 1, random);
    const Posed X_WA = random_pose(3, random), X_WB = random_pose(3, random);
    const ShapeDistance centred = shape_distance(a_shape, X_WA, b_shape, X_WB);
    a_shape.X_BG = random_pose(1, random), b_shape.X_BG = random_pose(1, random);
    const ShapeDistance placed =
        shape_distance(a_shape, X_WA * inverse(a_shape.X_BG), b_shape, X_WB * inverse(b_shape.X_BG));
    ASSERT_NEAR(placed.distance, centred.distance, centred.distance > 0 ? 1e-8 : 1e-3);
  }
}

// Symmetric bit for bit: searches prefer no direction.
TEST_P(ShapePair, ConcentricShapes) {
  Random random(6);
  for (int i = 0; i < 500; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Geometry a_shape = random_shape(a(), 0.1, 1, random), b_shape = random_shape(b(), 0.1, 1, random);
    const Posed X_WA = random_pose(1, random);
    for (const Posed& X_WB : {X_WA, Posed{random.rotation(), X_WA.p}}) {
      const ShapeDistance d = shape_distance(a_shape, X_WA, b_shape, X_WB);
      // The minimum extents are those of inscribed spheres.
      const auto min_depth = [](const Geometry& g) { return inside(g, Vector3d::zero()); };
      ASSERT_LE(d.distance, -min_depth(a_shape) - min_depth(b_shape) + 1e-9);
      ASSERT_GE(d.distance, -reach(a_shape) - reach(b_shape));
      ASSERT_NO_FATAL_FAILURE(check_points(a_shape, X_WA, b_shape, X_WB, d, 1e-3));
    }
  }
}

TEST_P(ShapePair, NonFinitePosesYieldNonFiniteDistances) {
  Random random(7);
  const Geometry a_shape = random_shape(a(), 0.1, 1, random), b_shape = random_shape(b(), 0.1, 1, random);
  Posed X_WB = Posed::identity();
  X_WB.p[1] = NAN;
  EXPECT_FALSE(std::isfinite(shape_distance(a_shape, Posed::identity(), b_shape, X_WB).distance));
}

TEST(ShapeDistance, NoneIsInfinitelyFar) {
  EXPECT_EQ(shape_distance({}, Posed::identity(), {Shape::sphere, {1, 0, 0}, {}}, Posed::identity()).distance,
            INFINITY);
}

TEST(ShapeDistance, KnownDistances) {
  const Geometry box{Shape::box, {2, 4, 6}, Posed::identity()}, rod{Shape::capsule, {0.1, 2, 0}, Posed::identity()},
      can{Shape::cylinder, {0.5, 2, 0}, Posed::identity()}, ball{Shape::sphere, {0.25, 0, 0}, Posed::identity()};
  const auto at = [](double x, double y, double z) { return Posed{Rotationd::identity(), {x, y, z}}; };
  EXPECT_NEAR(shape_distance(box, at(0, 0, 0), ball, at(4, 0, 0)).distance, 2.75, 1e-15);
  EXPECT_NEAR(shape_distance(box, at(0, 0, 0), ball, at(0.5, 0, 0)).distance, -0.75, 1e-15);
  EXPECT_NEAR(shape_distance(rod, at(0, 0, 0), ball, at(0, 0, 3)).distance, 1.65, 1e-15);
  EXPECT_NEAR(shape_distance(can, at(0, 0, 0), can, at(0, 0, 2.5)).distance, 0.5, 1e-14);
  EXPECT_NEAR(shape_distance(can, at(0, 0, 0), can, at(0.75, 0, 0.125)).distance, -0.25, 1e-9);
  EXPECT_NEAR(shape_distance(can, at(3.5, 0, 0), box, at(0, 0, 0)).distance, 2, 1e-14);
  // Rods that intersect in one point.
  const Posed turned{rotation_about({1, 0, 0}, M_PI_2), {0, 0.3, 0.4}};
  EXPECT_NEAR(shape_distance(rod, at(0, 0, 0), rod, turned).distance, -0.2, 1e-14);
  EXPECT_NEAR(std::abs(shape_distance(rod, at(0, 0, 0), rod, turned).normal[0]), 1, 1e-14);
}

// Rods one millimetre thick and ten metres long, nearly parallel and otherwise.
TEST(ShapeDistance, ThinRods) {
  Random random(8);
  for (const Shape shape : {Shape::capsule, Shape::cylinder, Shape::box}) {
    Worst error(std::string("thin rods, ") + shape_name(shape) + " [m]");
    for (int i = 0; i < 20'000; ++i) {
      SCOPED_TRACE(seed_note(i));
      const double r = 5e-4;
      const Geometry rod{shape, shape == Shape::box ? Vector3d{2 * r, 2 * r, 10} : Vector3d{r, 10, 0},
                         Posed::identity()};
      // Axes at `angle` to each other about the line between them.
      const double angle = random.chance(0.5) ? random.log_uniform(1e-9, 1) : random.uniform(0, M_PI);
      const double gap = random.log_uniform(1e-5, 1);
      const Posed X_WA{random.rotation(), random.vector(1)};
      const Posed X_AB{rotation_about({1, 0, 0}, angle), Vector3d{2 * r + gap, 0, 0}};
      const double slide = random.uniform(-3, 3);  // along B's axis
      const Posed X_WB = X_WA * Posed{X_AB.R, X_AB.p + X_AB.R * Vector3d{0, 0, slide}};
      const ShapeDistance d = shape_distance(rod, X_WA, rod, X_WB);
      ASSERT_LT(error.note(std::abs(d.distance - gap), i), 1e-8);  // measured 1.7e-10; not cylinders 1.3e-15
    }
  }
}

}  // namespace shape_distance_test
}  // namespace grapnel
