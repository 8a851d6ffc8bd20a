#include "oracle/two_body_impact.hpp"

#include <gtest/gtest.h>

#include "support/random_robot.hpp"

namespace grapnel {
namespace two_body_impact_test {

using namespace oracle;
using testing::Random;
using testing::seed_note;

PlanarBody random_body(Random& random) {
  const auto pair = [&] {
    const double x = random.uniform(-1, 1);
    return Eigen::Vector2d(x, random.uniform(-1, 1));
  };
  const double mass = random.uniform(1, 9), inertia = random.uniform(0.1, 4);
  const Eigen::Vector2d com = pair(), velocity = pair();
  return {mass, inertia, com, velocity, random.uniform(-2, 2)};
}
double energy(const PlanarBody& x, const Eigen::Vector2d& v, double w) {
  return 0.5 * (x.mass * v.squaredNorm() + x.inertia * w * w);
}
// Total momentum (p, l about the origin).
Eigen::Vector3d momentum(const PlanarBody& x, const Eigen::Vector2d& v, double w) {
  const Eigen::Vector2d p = x.mass * v;
  return {p[0], p[1], x.inertia * w + cross2(x.com, p)};
}

TEST(TwoBodyImpact, ConservesMomentumAndSatisfiesItsLaw) {
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const PlanarBody a = random_body(random), b = random_body(random);
    const double angle = random.uniform(-3, 3), e = random.uniform(0, 1);
    const Eigen::Vector2d c{random.uniform(-1, 1), random.uniform(-1, 1)}, n{std::cos(angle), std::sin(angle)};
    const auto relative = [&](const Eigen::Vector2d& v1, double w1, const Eigen::Vector2d& v2,
                              double w2) -> Eigen::Vector2d {
      return v1 + turn2(w1, c - a.com) - v2 - turn2(w2, c - b.com);
    };
    const Eigen::Vector3d before = momentum(a, a.velocity, a.rate) + momentum(b, b.velocity, b.rate);
    ASSERT_GT(before.norm(), 1e-3);
    for (const PlanarImpact& x : {frictionless_impact(a, b, c, n, e), rigid_grasp(a, b, c)}) {
      const Eigen::Vector3d after = momentum(a, x.velocity1, x.rate1) + momentum(b, x.velocity2, x.rate2);
      ASSERT_LT((after - before).norm(), 1e-13 * (1 + before.norm()));  // measured 2e-15
      // Each body separately: the impulse at c explains its change, with opposite signs.
      const double l = x.angular_impulse + cross2(c, x.impulse);
      ASSERT_LT((momentum(a, x.velocity1, x.rate1) - momentum(a, a.velocity, a.rate) -
                 Eigen::Vector3d(x.impulse[0], x.impulse[1], l))
                    .norm(),
                1e-13);
      ASSERT_LE(energy(a, x.velocity1, x.rate1) + energy(b, x.velocity2, x.rate2),
                energy(a, a.velocity, a.rate) + energy(b, b.velocity, b.rate) + 1e-12);
    }
    const Eigen::Vector2d u = relative(a.velocity, a.rate, b.velocity, b.rate);
    const PlanarImpact bounce = frictionless_impact(a, b, c, n, e), stuck = rigid_grasp(a, b, c);
    ASSERT_NEAR(relative(bounce.velocity1, bounce.rate1, bounce.velocity2, bounce.rate2).dot(n), -e * u.dot(n), 1e-12);
    ASSERT_LT(relative(stuck.velocity1, stuck.rate1, stuck.velocity2, stuck.rate2).norm(), 1e-12);
  }
}

// Through both centres the eccentric formula is the one on a line.
TEST(TwoBodyImpact, IsCentralThroughTheCentres) {
  const PlanarBody a{2, 1, {0, 0}, {3, 0}, 0}, b{4, 5, {1, 0}, {-1, 0}, 0};
  const PlanarImpact x = frictionless_impact(a, b, {0.5, 0}, {1, 0}, 0);
  EXPECT_DOUBLE_EQ(x.impulse[0], central_impulse(2, 3, 4, -1, 0));
  EXPECT_DOUBLE_EQ(x.impulse[0], -16.0 / 3);
  EXPECT_DOUBLE_EQ(x.velocity1[0], 1.0 / 3);
  EXPECT_DOUBLE_EQ(x.velocity2[0], 1.0 / 3);
}

}  // namespace two_body_impact_test
}  // namespace grapnel
