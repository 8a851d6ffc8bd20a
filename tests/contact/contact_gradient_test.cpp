// The elastic force is the gradient of the elastic energy; forces are continuous; both bodies and all frames are alike.

#include <gtest/gtest.h>

#include "contact/contact_cases.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing::contact_gradient {
namespace {

struct Case {
  CaseShape a, b;
};
std::vector<Case> all_pairs() {
  std::vector<Case> pairs;
  for (const CaseShape a : kCaseShapes) {
    for (const CaseShape b : kCaseShapes) {
      if (static_cast<int>(a) <= static_cast<int>(b) && a != CaseShape::half_space) pairs.push_back({a, b});
    }
  }
  return pairs;
}
std::string name_of_case(const ::testing::TestParamInfo<Case>& info) {
  return std::string(name_of(info.param.a)) + "_" + name_of(info.param.b);
}

Twistd random_twist(Random& random) { return {random.vector(5), random.vector(1)}; }
const Twistd kRest = Twistd::zero();

// The integral along the axis by midpoints, of a capsule whose ends are far from the hull or not.
TEST(ContactEnergy, OfCapsulesOnHullsIsTheIntegralOfTheSquaredDepth) {
  Worst worst("energy and its integral by 1e5 midpoints, relative");
  for (int i = 0; i < 20; ++i) {
    Random random(4000 + i);
    const ContactShape a = random_contact_shape(CaseShape::capsule, random);
    const ContactShape b = random_contact_shape(i % 2 ? CaseShape::hull : CaseShape::box, random);
    const ContactLaw law = elastic_law(false);
    PairContact pair(a, b, law);
    const Posed X_WA{random.rotation(), random.vector(1)};
    const Posed X_WB = overlapping_pose(a, b, X_WA, 5e-3, random);
    const Posed X_BA = inverse(X_WB * b.X_BC()) * (X_WA * a.X_BC());
    const double half = a.core().half[2];
    const auto square = [&](double z) {
      const double depth = a.core().rounding - b.distance(X_BA * Vector3d{0, 0, z}).distance;
      return depth > 0 ? 0.5 * law.elastic * depth * depth : 0;
    };
    double sum = square(-half) + square(half);
    constexpr int kPoints = 100000;
    for (int k = 0; k < kPoints; ++k) sum += square(half * (2 * (k + 0.5) / kPoints - 1)) / kPoints;
    EXPECT_LT(worst.note(std::abs(pair.elastic_energy(X_WA, X_WB) / sum - 1), i), 1e-7);
  }
}

class PairOf : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(All, PairOf, ::testing::ValuesIn(all_pairs()), name_of_case);

TEST_P(PairOf, HasTheForceThatIsTheGradientOfItsEnergy) {
  Worst worst("power of the elastic force and change of energy, relative");
  int touching = 0;
  const bool slow = GetParam().a == CaseShape::round_hull || GetParam().b == CaseShape::round_hull;
  const int cases = test::repetitions(slow ? 10 : 60);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const ContactShape a = random_contact_shape(GetParam().a, random), b = random_contact_shape(GetParam().b, random);
    PairContact pair(a, b, elastic_law(random.chance(0.5)));
    const Posed X_WA{random.rotation(), random.vector(1)};
    const double depth = random.log_uniform(1e-4, 1e-2);
    const Posed X_WB = overlapping_pose(a, b, X_WA, depth, random);
    const Twistd V_A = random_twist(random), V_B = random_twist(random);
    const ContactForce force = pair.evaluate({X_WA, kRest}, {X_WB, kRest});
    if (!force.touches) continue;
    ++touching;
    EXPECT_EQ(force.damping_power, 0);
    EXPECT_EQ(force.friction_power, 0);
    const double power =
        dot(force.on_a, shift(V_A, force.p_WC - X_WA.p)) + dot(force.on_b, shift(V_B, force.p_WC - X_WB.p));
    const auto energy = [&](double t) { return pair.elastic_energy(moved(X_WA, V_A, t), moved(X_WB, V_B, t)); };
    const double h = 2e-3 * depth;
    const double slope = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
    const double scale = norm(force.on_b.linear) * (norm(V_A.linear) + norm(V_B.linear));
    EXPECT_LT(worst.note(std::abs(power + slope) / scale, i), 3e-5);  // measured 1e-5
  }
  EXPECT_GT(touching, test::kSanitized ? 0 : slow ? 8 : 50);
}

TEST_P(PairOf, HasExactlyOppositeWrenchesAlikeForExchangedBodiesAndInAnyFrame) {
  Worst exchange("exchanged bodies, relative"), turned("turned frame, relative");
  for (int i = 0; i < test::repetitions(20); ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(1000 + i);
    const ContactShape a = random_contact_shape(GetParam().a, random), b = random_contact_shape(GetParam().b, random);
    ContactMaterial m, n;
    m.modulus = 1e7, n.modulus = 3e6;
    m.dissipation = 0.5, n.dissipation = 0.2, m.damping = 100, n.damping = 10;
    m.static_friction = n.static_friction = 0.5, m.kinetic_friction = n.kinetic_friction = 0.3;
    m.rolling_length = n.rolling_length = 1e-3, m.torsional_length = n.torsional_length = 2e-3;
    PairContact pair(a, b, combine(m, n)), exchanged(b, a, combine(n, m));
    const MovingBody A{{random.rotation(), random.vector(1)}, random_twist(random)};
    const MovingBody B{overlapping_pose(a, b, A.X_WB, 3e-3, random), random_twist(random)};
    const ContactForce f = pair.evaluate(A, B), g = exchanged.evaluate(B, A);
    EXPECT_TRUE(f.touches);
    EXPECT_GE(f.damping_power, 0);
    EXPECT_GE(f.friction_power, 0);
    const double scale = f.normal_force + 1e-9;
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(f.on_a.linear[k], -f.on_b.linear[k]);
      EXPECT_EQ(f.on_a.angular[k], -f.on_b.angular[k]);
    }
    const Wrenchd back = shift(g.on_a, f.p_WC - g.p_WC);
    EXPECT_LT(exchange.note(norm(f.on_b.linear - back.linear) / scale, i), 1e-8);
    EXPECT_LT(exchange.note(norm(f.on_b.angular - back.angular) / scale, i), 1e-8);
    EXPECT_LT(exchange.note(std::abs(f.friction_power - g.friction_power) / scale, i), 1e-8);

    const Posed X_VW{random.rotation(), random.vector(3)};
    const auto in_v = [&](const MovingBody& x) { return MovingBody{X_VW * x.X_WB, X_VW.R * x.V_WB}; };
    const ContactForce h = pair.evaluate(in_v(A), in_v(B));
    EXPECT_LT(turned.note(norm(h.on_b.linear - X_VW.R * f.on_b.linear) / scale, i), 1e-8);
    EXPECT_LT(turned.note(norm(shift(h.on_b, X_VW * f.p_WC - h.p_WC).angular - X_VW.R * f.on_b.angular) / scale, i),
              1e-8);
  }
}

TEST_P(PairOf, IsFiniteAtAnyPose) {
  const bool slow = GetParam().a == CaseShape::round_hull || GetParam().b == CaseShape::round_hull;
  const bool slowest = GetParam().a == CaseShape::round_hull && GetParam().b == CaseShape::round_hull;
  for (int i = 0; i < (test::kSanitized || slowest ? 2 : slow ? 4 : 40); ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(3000 + i);
    const ContactShape a = random_contact_shape(GetParam().a, random), b = random_contact_shape(GetParam().b, random);
    ContactMaterial m;
    m.modulus = 1e7, m.static_friction = 0.5, m.kinetic_friction = 0.3, m.dissipation = 0.2, m.damping = 10;
    PairContact pair(a, b, combine(m, m));
    const Posed X_WA{random.rotation(), random.vector(1)};
    // Cores at one place with parallel axes, then random ones.
    const Posed X_WB =
        (i == 0) ? X_WA * a.X_BC() * inverse(b.X_BC()) : Posed{random.rotation(), X_WA.p + random.vector(0.3)};
    const ContactForce& f = pair.evaluate({X_WA, random_twist(random)}, {X_WB, random_twist(random)});
    EXPECT_TRUE(std::isfinite(norm(f.on_a.linear) + norm(f.on_a.angular) + norm(f.p_WC)));
    EXPECT_TRUE(std::isfinite(f.depth + f.slip_speed));
    EXPECT_GE(f.damping_power, 0);
    EXPECT_GE(f.friction_power, 0);
    if (i == 0 && GetParam().a <= CaseShape::capsule && GetParam().b != CaseShape::half_space) {
      EXPECT_TRUE(f.beyond_model);  // the centre of A is inside of B
    }
    EXPECT_TRUE(std::isfinite(pair.elastic_energy(X_WA, X_WB)));
  }
}

// B turns through faces, edges and vertices, at a constant overlap along a line. A jump is a change per step that does
// not shrink with the step.
TEST_P(PairOf, HasContinuousForcesAlongSweepsThroughFacesEdgesAndVertices) {
  Worst worst("largest change in a step of 1/8, relative to that in a full step");
  const bool slow = GetParam().a == CaseShape::round_hull || GetParam().b == CaseShape::round_hull;
  const double range = slow ? 0.08 : 0.5;
  for (int i = 0; i < test::repetitions(3); ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(2000 + i);
    const ContactShape a = random_contact_shape(GetParam().a, random), b = random_contact_shape(GetParam().b, random);
    ContactMaterial m;
    m.modulus = 1e7, m.static_friction = 0.5, m.kinetic_friction = 0.3, m.dissipation = 0.2, m.damping = 10;
    m.stiction_speed = 0.05, m.damping_depth = 1e-3;
    PairContact pair(a, b, combine(m, m));
    const Posed X_WA{random.rotation(), random.vector(1)};
    const Rotationd start = random.rotation();
    const Vector3d direction = random.direction(), axis = random.direction();
    const Twistd slip = random_twist(random);
    const auto wrench = [&](double angle) {
      Posed X_WB = touching_pose(pair, a, b, X_WA, rotation_about(axis, angle) * start, direction);
      const bool plane = b.kind() == ContactShape::Kind::half_space;
      X_WB.p -= 4e-3 * (plane ? -(X_WB.R * b.X_BC().R.column(2)) : direction);
      const ContactForce& f = pair.evaluate({X_WA, kRest}, {X_WB, slip});
      EXPECT_FALSE(f.beyond_model);
      return shift(f.on_b, X_WA.p - f.p_WC);
    };
    const auto largest = [&](int steps) {
      double change = 0, size = 0;
      Wrenchd before = wrench(0);
      for (int k = 1; k <= steps; ++k) {
        const Wrenchd now = wrench(range * k / steps);
        change = std::max(change, norm(now.linear - before.linear) + norm(now.angular - before.angular));
        size = std::max(size, norm(now.linear));
        before = now;
      }
      EXPECT_GT(size, 0);
      return change / size;
    };
    const double coarse = largest(slow ? 40 : 250), fine = largest(slow ? 320 : 2000);
    EXPECT_LT(worst.note(fine / coarse, i), 0.35) << coarse << " " << fine;  // 1/8 if differentiable
  }
}

}  // namespace
}  // namespace grapnel::testing::contact_gradient
