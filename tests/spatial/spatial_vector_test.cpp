// Spatial vectors: their meaning, and that invalid algebra does not compile.
#include "grapnel/spatial/spatial_vector.hpp"

#include <gtest/gtest.h>

#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel {
namespace spatial_vector_test {

using namespace testing;

template <class A, class B>
concept Addable = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept AddableInPlace = requires(A a, B b) {
  a += b;
};
template <class A, class B>
concept Dottable = requires(A a, B b) {
  dot(a, b);
};
template <class A, class B>
concept Multipliable = requires(A a, B b) {
  a* b;
};

// Equal kinds can be added; the only mixture is momentum + impulse.
static_assert(Addable<Twistd, Twistd> && Addable<Wrenchd, Wrenchd> && Addable<Impulsed, Impulsed>);
static_assert(Addable<Momentumd, Impulsed>);
static_assert(!Addable<Wrenchd, Impulsed> && !Addable<Impulsed, Wrenchd>, "a force is not an impulse");
static_assert(!Subtractable<Wrenchd, Impulsed> && !AddableInPlace<Wrenchd, Impulsed> &&
              !AddableInPlace<Impulsed, Wrenchd>);
static_assert(!Addable<Twistd, Wrenchd> && !Addable<Twistd, SpatialAccelerationd> && !Addable<Twistd, Momentumd>);
static_assert(!Addable<Wrenchd, Momentumd> && !Addable<Impulsed, Momentumd>);
static_assert(!std::is_convertible_v<Wrenchd, Impulsed> && !std::is_assignable_v<Impulsed&, Wrenchd>);
static_assert(!std::is_convertible_v<Twistd, SpatialAccelerationd> &&
              !std::is_assignable_v<Twistd&, SpatialAccelerationd>);
// Products for power, energy and work exist; others do not.
static_assert(Dottable<Wrenchd, Twistd> && Dottable<Momentumd, Twistd> && Dottable<Impulsed, Twistd>);
static_assert(!Dottable<Wrenchd, Wrenchd> && !Dottable<Twistd, Twistd> && !Dottable<Wrenchd, SpatialAccelerationd>);
// Inertia makes momentum of twists and wrenches of accelerations.
static_assert(std::is_same_v<decltype(RigidBodyInertiad{} * Twistd{}), Momentumd>);
static_assert(std::is_same_v<decltype(RigidBodyInertiad{} * SpatialAccelerationd{}), Wrenchd>);
static_assert(!Multipliable<RigidBodyInertiad, Wrenchd> && !Multipliable<RigidBodyInertiad, Momentumd>);

template <class V>
V random_spatial(Random& random) {
  const Vector3d angular = random.vector(2);
  return {angular, random.vector(2)};
}

TEST(SpatialVector, IsAVectorSpace) {
  const Twistd a{{1, 2, 3}, {4, 5, 6}}, b{{-1, 0, 1}, {2, -2, 0.5}};
  EXPECT_EQ(eigen(a + b), eigen(a) + eigen(b));
  EXPECT_EQ(eigen(a - b), eigen(a) - eigen(b));
  EXPECT_EQ(eigen(-a), -eigen(a));
  EXPECT_EQ(eigen(2.0 * a), 2 * eigen(a));
  EXPECT_EQ(eigen(Momentumd{{1, 1, 1}, {2, 2, 2}} + Impulsed{{1, 0, 0}, {0, 3, 0}}),
            eigen(Momentumd{{2, 1, 1}, {2, 5, 2}}));
}

TEST(SpatialVector, KnownShifts) {
  // Rotation about z at 2 rad/s: a point at x = 1 moves along y at 2 m/s.
  const Twistd V = shift(Twistd{{0, 0, 2}, {0, 0, 0}}, {1, 0, 0});
  EXPECT_EQ(eigen(V), eigen(Twistd{{0, 0, 2}, {0, 2, 0}}));
  // A force along y at the origin has moment -1 about the point x = 1.
  const Wrenchd F = shift(Wrenchd{{0, 0, 0}, {0, 1, 0}}, {1, 0, 0});
  EXPECT_EQ(eigen(F), eigen(Wrenchd{{0, 0, -1}, {0, 1, 0}}));
}

// Power is independent of the common point and frame; two shifts commute.
TEST(SpatialVector, PowerIsInvariant) {
  Random random(0);
  for (int i = 0; i < 200; ++i) {
    const Twistd V = random_spatial<Twistd>(random);
    const Wrenchd F = random_spatial<Wrenchd>(random);
    const Vector3d p = random.vector(3), q = random.vector(3);
    const Rotationd R = random.rotation();
    EXPECT_NEAR(dot(shift(F, p), shift(V, p)), dot(F, V), 1e-13);
    EXPECT_NEAR(dot(R * F, R * V), dot(F, V), 1e-13);
    EXPECT_LT((eigen(shift(shift(V, p), q)) - eigen(shift(V, p + q))).norm(), 1e-14);
    EXPECT_LT((eigen(transposed_times(R, R * F)) - eigen(F)).norm(), 1e-14);
  }
}

// V x and V x* are transposes: (V x A) . h = -A . (V x* h).
TEST(SpatialVector, CrossProductsAreDual) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Twistd V = random_spatial<Twistd>(random), A = random_spatial<Twistd>(random);
    const Momentumd h = random_spatial<Momentumd>(random);
    const SpatialAccelerationd VA = cross_motion(V, A);
    const Wrenchd Vh = cross_force(V, h);
    EXPECT_NEAR(dot(h, Twistd{VA.angular, VA.linear}) + dot(Vh, A), 0, 1e-13);
    EXPECT_LT(eigen(cross_motion(V, V)).norm(), 1e-14);
  }
}

}  // namespace spatial_vector_test
}  // namespace grapnel
