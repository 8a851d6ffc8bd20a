// Overlapping shapes: always detected; the depth separates them and is nearly minimal.
#include <gtest/gtest.h>

#include "contact/random_shape.hpp"
#include "grapnel/contact/clearance_model.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace penetration_test {

using namespace testing;

class Overlap : public ::testing::TestWithParam<std::tuple<Shape, Shape>> {
 protected:
  Shape a() const { return std::get<0>(GetParam()); }
  Shape b() const { return std::get<1>(GetParam()); }
  bool exact() const {
    const auto round = [](Shape s) { return s == Shape::cylinder; };
    return a() == Shape::sphere || b() == Shape::sphere || !(round(a()) || round(b()));
  }
};
INSTANTIATE_TEST_SUITE_P(, Overlap, ::testing::Combine(::testing::ValuesIn(kShapes), ::testing::ValuesIn(kShapes)),
                         [](const auto& i) {
                           return std::string(shape_name(std::get<0>(i.param))) + "_" +
                                  shape_name(std::get<1>(i.param));
                         });

// A point of the shape, often near its surface.
Vector3d inner_point(const Geometry& g, Random& random) {
  const double fraction = random.chance(0.5) ? random.uniform(0, 1) : 1 - random.log_uniform(1e-5, 1e-2);
  return fraction * farthest(g, random_normal(random), random);
}

// A common point and the largest balls about it in each shape bound the depth from below.
TEST_P(Overlap, IsDetectedForEveryCommonPoint) {
  Random random(11);
  Worst closest("largest signed distance over the bound of common balls [m]");
  for (int i = 0; i < 30'000; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Geometry a_shape = random_shape(a(), 0.02, 1, random), b_shape = random_shape(b(), 0.02, 1, random);
    const Vector3d p_A = inner_point(a_shape, random), p_B = inner_point(b_shape, random);
    const Posed X_WA = random_pose(1, random);
    const Rotationd R_WB = random.rotation();
    const Posed X_WB{R_WB, X_WA * p_A - R_WB * p_B};
    const double min_depth = inside(a_shape, p_A) + inside(b_shape, p_B);
    const ShapeDistance d = shape_distance(a_shape, X_WA, b_shape, X_WB);
    ASSERT_LT(d.distance, 0);
    ASSERT_LT(closest.note(d.distance + min_depth, i), 1e-9);  // measured 1.5e-16
  }
}

TEST_P(Overlap, DepthSeparatesAndIsNearlyMinimal) {
  Random random(12);
  Worst excess("depth above the least one sampled, relative, of " + std::string(shape_name(a())) + " and " +
               shape_name(b()));
  Worst parted("distance after moving apart by the depth [m]");
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Geometry a_shape = random_shape(a(), 0.1, 1, random), b_shape = random_shape(b(), 0.1, 1, random);
    const Posed X_WA = random_pose(0.3, random), X_WB = random_pose(0.3, random);
    const ShapeDistance d = shape_distance(a_shape, X_WA, b_shape, X_WB);
    if (d.distance > -1e-3) continue;
    const auto depth_along = [&](const Vector3d& n) {
      return extent(a_shape, transposed_times(X_WA.R, n)) + extent(b_shape, transposed_times(X_WB.R, n)) -
             dot(n, X_WB.p - X_WA.p);
    };
    // The depth is measured along the normal: after a displacement by the depth along the normal, the shapes just
    // touch.
    ASSERT_NEAR(depth_along(d.normal), -d.distance, 1e-7);  // measured 2.2e-9, rods in cylinders
    const Posed apart{X_WB.R, X_WB.p - d.distance * d.normal};
    ASSERT_LT(parted.note(std::abs(shape_distance(a_shape, X_WA, b_shape, apart).distance), i),
              1e-6);  // measured 1.7e-12
    // Sampled directions; random perturbations improve the best of them.
    Vector3d best = d.normal;
    double smallest = INFINITY;
    for (int k = 0; k < 3000; ++k) {
      const Vector3d n = random.direction();
      if (const double h = depth_along(n); h < smallest) smallest = h, best = n;
    }
    double step = 0.1;
    for (int k = 0; k < 3000; ++k, step *= 0.997) {
      Vector3d n = best + step * random.direction();
      n *= 1 / norm(n);
      if (const double h = depth_along(n); h < smallest) smallest = h, best = n;
    }
    // measured: below zero, no sampled direction is better
    ASSERT_LT(excess.note((-d.distance - smallest) / smallest, i), exact() ? 1e-9 : 1e-3);
  }
}

}  // namespace penetration_test
}  // namespace grapnel
