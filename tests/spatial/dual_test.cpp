/// Dual numbers against elementary derivatives, and against finite differences.

#include "grapnel/spatial/dual.hpp"

#include <gtest/gtest.h>

#include "grapnel/spatial/spatial_vector.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace dual_test {

TEST(Dual, ConstantsHaveNoDerivative) {
  constexpr Dual a = 3.5, b = 2 * a - 1;
  static_assert(b.value == 6 && b.derivative == 0);
  static_assert(Dual{}.value == 0 && Dual{}.derivative == 0);
}

TEST(Dual, RulesOfArithmetic) {
  const Dual x{0.7, 1}, y{-1.9, 3};
  const auto is = [](const Dual& a, double value, double derivative) {
    EXPECT_DOUBLE_EQ(a.value, value);
    EXPECT_NEAR(a.derivative, derivative, 1e-15 * std::abs(derivative));
  };
  is(x + y, -1.2, 4);
  is(x - y, 2.6, -2);
  is(-x, -0.7, -1);
  is(x * y, 0.7 * -1.9, -1.9 + 0.7 * 3);
  is(x / y, 0.7 / -1.9, (-1.9 - 0.7 * 3) / (1.9 * 1.9));
  is(2.0 / x, 2 / 0.7, -2 / 0.49);
  is(sqrt(x), std::sqrt(0.7), 0.5 / std::sqrt(0.7));
  is(sin(y), std::sin(-1.9), 3 * std::cos(1.9));
  is(cos(y), std::cos(1.9), 3 * std::sin(1.9));
  EXPECT_TRUE(y < x && x > y && !(x < y));
  Dual z = x;
  const Dual& same = z;
  z *= same;  // the operand is also the result
  is(z, 0.49, 1.4);
  z /= same;
  is(z, 1, 0);
}

// A chain of all operations, along random directions; d/ds of f(x + s d).
TEST(Dual, ChainRule) {
  Worst worst("against differences of fourth order");
  const auto f = [](const auto& a, const auto& b) {
    using std::cos;
    using std::sin;
    using std::sqrt;
    auto c = sin(a * b) / (a * a + b * b + 1.0);
    c -= sqrt(1.5 + cos(b)) * a;
    c += a / (2.0 + sin(c));
    return c;
  };
  for (int i = 0; i < 100; ++i) {
    Random random(i);
    const double a = random.uniform(-2, 2), b = random.uniform(-2, 2), da = random.uniform(-1, 1),
                 db = random.uniform(-1, 1), h = 1e-3;
    const auto at = [&](double s) { return f(a + s * da, b + s * db); };
    const Dual exact = f(Dual{a, da}, Dual{b, db});
    const double numeric = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    EXPECT_NEAR(exact.value, at(0), 1e-15 * (1 + std::abs(at(0))));
    EXPECT_LT(worst.note(std::abs(exact.derivative - numeric), i), 1e-9);
  }
}

// In the spatial types: d/dt (R(t) v) = w x R v for a rotation about an axis, and a quaternion's rate.
TEST(Dual, WorksInSpatialAlgebra) {
  Worst worst("R' v against w x R v");
  for (int i = 0; i < 50; ++i) {
    Random random(100 + i);
    const Vector3d w = random.vector(2), v = random.vector(1);
    const Rotationd R = random.rotation();
    const Quaterniond q = quaternion_from(R), rate = quaternion_rate(q, transposed_times(R, w));
    const Quaternion<Dual> moving{Dual{q.w, rate.w}, Dual{q.x, rate.x}, Dual{q.y, rate.y}, Dual{q.z, rate.z}};
    const Vector3<Dual> turned = rotation_matrix(moving) * Vector3<Dual>{v[0], v[1], v[2]};
    const Vector3d wanted = cross(w, R * v);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(turned[k].value, (R * v)[k], 1e-14);
      EXPECT_LT(worst.note(std::abs(turned[k].derivative - wanted[k]), i), 1e-14);
    }
  }
}

// The parallel-axis theorem differentiated: an inertia seen from a point that moves.
TEST(Dual, WorksInInertia) {
  const auto I =
      RigidBodyInertia<Dual>::about_com(Dual{3, 1}, {Dual{0.5, 2}, 0, 0}, Symmetric3<Dual>::diagonal(1, 2, Dual{4, 5}));
  EXPECT_DOUBLE_EQ(I.mass.derivative, 1);
  EXPECT_DOUBLE_EQ(I.first_moment[0].derivative, 1 * 0.5 + 3 * 2);
  EXPECT_DOUBLE_EQ(I.rotational.yy.derivative, 1 * 0.25 + 3 * 2 * 0.5 * 2);
  EXPECT_DOUBLE_EQ(I.rotational.zz.derivative, 5 + 1 * 0.25 + 3 * 2 * 0.5 * 2);
  EXPECT_DOUBLE_EQ(I.rotational.xx.derivative, 0);
}

}  // namespace dual_test
}  // namespace grapnel::testing
