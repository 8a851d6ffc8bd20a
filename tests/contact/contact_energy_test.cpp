// The energy of surfaces of equal pressure against closed forms at any depth, and the quantities by which pairs that do
// not touch are watched.

#include <gtest/gtest.h>

#include "contact/contact_cases.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "support/worst.hpp"

namespace grapnel::testing::contact_energy {
namespace {

ContactShape box(const Vector3d& half) {
  return ContactShape(primitive(Geometry::Shape::box, {2 * half[0], 2 * half[1], 2 * half[2]}));
}
// The same box as a hull.
ContactShape box_hull(const Vector3d& half) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back({i & 1 ? half[0] : -half[0], i & 2 ? half[1] : -half[1], i & 4 ? half[2] : -half[2]});
  return ContactShape(hull_geometry(corners));
}

ContactLaw equal_law() {
  ContactMaterial m;
  m.modulus = 1e7;
  return combine(m, m);
}

// A box with the half widths a and b of its face, at the depth d in a wider one with the same slope K of the pressure.
// Per area, min(K z, K (d - z), K e) over the depth z gives K d^2/4, and K e (d - e) at distances e < d/2 from the
// edge.
double energy_on_face(double slope, double a, double b, double d) {
  return slope * (0.25 * d * d * (2 * a - d) * (2 * b - d) + (a + b) * d * d * d / 3 - 5 * d * d * d * d / 24);
}

constexpr double kDepths[] = {3e-2, 1e-3, 1e-5, 1e-7, 1e-9};

// The wider box has its faces far away, or in the planes of the other one's; then both have the same fields there.
TEST(ContactEnergy, OfBoxesOnFacesIsExactAtAnyDepth) {
  Worst worst("energy and closed form, relative to the rounding error of the depth");
  const Vector3d half{0.15, 0.12, 0.1};
  for (const double wider : {0.2, 0.0}) {
    PairContact pair(box({half[0] + wider, half[1] + wider, half[2]}), box(half), equal_law());
    for (const double depth : kDepths) {
      const double height = 2 * half[2] - depth, overlap = 2 * half[2] - height;
      const double energy = pair.elastic_energy(Posed::identity(), {Rotationd::identity(), {0, 0, height}});
      const double exact = energy_on_face(equal_law().elastic_a / half[2], half[0], half[1], overlap);
      EXPECT_LT(worst.note(std::abs(energy / exact - 1) * overlap, 0), 1e-15) << depth;  // measured 4e-17
    }
  }
}

// Boxes as hulls have other directions of overlap and regions, and other orders of faces and shapes.
TEST(ContactEnergy, DependsOnTheShapesAlone) {
  Worst worst("energies of boxes and hulls, relative to the rounding error of the depth");
  for (int i = 0; i < 40; ++i) {
    Random random(5000 + i);
    const Vector3d a{0.1, 0.05, 0.17}, b{0.03, 0.1, 0.01};
    const ContactLaw law = elastic_law(false);
    PairContact boxes(box(a), box(b), law), hulls(box_hull(a), box_hull(b), law);
    const double depth = random.log_uniform(1e-7, 1e-3), tilt = random.log_uniform(1e-9, 1);
    const Posed X_WA{random.rotation(), random.vector(1)};
    Posed X_WB = X_WA * Posed{rotation_about(random.direction(), tilt), {0.5, 0.01, 0.05}};
    const ShapeSeparation apart = boxes.separation(X_WA, X_WB);
    X_WB.p -= (apart.distance + depth) * apart.normal;
    const double energy = boxes.elastic_energy(X_WA, X_WB), other = hulls.elastic_energy(X_WA, X_WB);
    ASSERT_GT(energy, 0);
    EXPECT_LT(worst.note(std::abs(energy / other - 1) * depth, i), 1e-14);
  }
}

TEST(ContactOverlap, IsPositiveExactlyWhereShapesOverlap) {
  for (const CaseShape kind : kCaseShapes) {
    for (int i = 0; i < (kind == CaseShape::round_hull ? 4 : 30); ++i) {
      SCOPED_TRACE(std::string(name_of(kind)) + " " + seed_note(i));
      Random random(6000 + i);
      const ContactShape a = random_contact_shape(CaseShape::box, random), b = random_contact_shape(kind, random);
      PairContact pair(a, b, elastic_law());
      const Posed X_WA{random.rotation(), random.vector(1)};
      const double depth = random.log_uniform(1e-6, 1e-2);
      const Posed inside = overlapping_pose(a, b, X_WA, depth, random);
      const double overlap = pair.overlap(X_WA, inside);
      EXPECT_GT(overlap, 0);
      EXPECT_LT(overlap, -2 * pair.gap(X_WA, inside));
      Posed outside = inside;
      const ShapeSeparation s = pair.separation(X_WA, inside);
      outside.p += (depth - pair.gap(X_WA, inside)) * s.normal;
      if (pair.gap(X_WA, outside) > 0.5 * depth) {
        EXPECT_LT(pair.overlap(X_WA, outside), 0);
      }
    }
  }
}

// Of turning bodies the velocities at the nearest points change, so these stay apart for a third of it.
TEST(ContactWatch, PairsDoNotTouchBeforeTheirClearTime) {
  int tested = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(7000 + i);
    const CaseShape kinds[] = {CaseShape::sphere, CaseShape::capsule, CaseShape::cylinder, CaseShape::box,
                               CaseShape::half_space};
    const ContactShape a = random_contact_shape(kinds[i % 4], random), b = random_contact_shape(kinds[i % 5], random);
    const Posed X_WA{random.rotation(), random.vector(1)};
    Posed X_WB = overlapping_pose(a, b, X_WA, 1e-3, random);
    const ShapeSeparation s = PairContact(a, b, elastic_law()).separation(X_WA, X_WB);
    X_WB.p += random.uniform(0.8, 3) * s.normal;
    ContactSet set({{0, a}, {1, b}}, {{0, 1, elastic_law()}}, 1);
    Kinematics kinematics;
    kinematics.X_WB = {X_WA, X_WB};
    const bool turns = i % 2 == 1;
    const Vector3d w_A = random.vector(1), w_B = random.vector(1);
    kinematics.V_WB = {{turns ? w_A : Vector3d::zero(), random.vector(1)}, {turns ? w_B : Vector3d::zero(), -s.normal}};
    set.begin(0, kinematics);
    const double clear = set.clear_time(kinematics);
    ASSERT_GE(clear, 0);
    if (clear == 0) continue;
    const double span = turns ? clear / 3 : clear;
    for (int k = 1; k <= 50; ++k) {
      Kinematics later = kinematics;
      for (int body = 0; body < 2; ++body)
        later.X_WB[body] = moved(kinematics.X_WB[body], kinematics.V_WB[body], span * k / 51);
      EXPECT_GT(set.margin(0, later), 0) << k;
    }
    ++tested;
  }
  EXPECT_GT(tested, 30);
}

TEST(ContactWatch, HasNoClearTimeInContact) {
  const ContactShape ball(primitive(Geometry::Shape::sphere, {0.1, 0, 0}));
  Kinematics kinematics;
  kinematics.X_WB = {Posed::identity(), {Rotationd::identity(), {0.199, 0, 0}}};
  kinematics.V_WB = {Twistd::zero(), Twistd::zero()};
  ContactSet set({{0, ball}, {1, ball}}, {{0, 1, elastic_law()}}, 1);
  set.begin(0, kinematics);
  EXPECT_EQ(set.clear_time(kinematics), 0);
}

}  // namespace
}  // namespace grapnel::testing::contact_energy
