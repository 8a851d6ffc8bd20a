// The energy of surfaces of equal pressure against closed forms at any depth, and the quantities by which pairs that do
// not touch are watched.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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

// Bodies that move and turn uniformly: velocities at their nearest points change.
TEST(ContactWatch, PairsThatAreNotWatchedStayApartThroughoutTheStep) {
  int clear = 0, watched = 0, close = 0;
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
    Kinematics begin;
    begin.X_WB = {X_WA, X_WB};
    begin.V_WB = {{random.vector(1), random.vector(1)}, {random.vector(1), -s.normal}};
    set.begin(0, begin);
    for (const double duration : {0.05, 0.1, 0.2, 0.4, 0.8, 1.6}) {
      const auto at = [&](double t) {
        Kinematics later = begin;
        for (int body = 0; body < 2; ++body) later.X_WB[body] = moved(begin.X_WB[body], begin.V_WB[body], t);
        return later;
      };
      double least = std::numeric_limits<double>::infinity();
      for (int k = 0; k <= 50; ++k) least = std::min(least, set.separation(0, at(duration * k / 50)).distance);
      set.begin_step(begin);
      const bool is_watched = set.end_step(at(duration), duration);
      EXPECT_TRUE(is_watched || least > 0) << duration;
      EXPECT_EQ(std::isinf(set.margin(0, at(duration))), !is_watched);
      ++(is_watched ? watched : clear);
      close += least <= 0;
    }
  }
  EXPECT_GT(clear, 100);
  EXPECT_GT(watched, 100);
  EXPECT_GT(close, 5);
}

// Bodies at rest at both ends of a step, of which one has passed the other.
TEST(ContactWatch, PairsThatMoveFromRestToRestAreWatched) {
  const ContactShape ball(primitive(Geometry::Shape::sphere, {0.1, 0, 0}));
  Kinematics kinematics;
  kinematics.X_WB = {Posed::identity(), {Rotationd::identity(), {0.5, 0, 0}}};
  kinematics.V_WB = {Twistd::zero(), Twistd::zero()};
  ContactSet set({{0, ball}, {1, ball}}, {{0, 1, elastic_law()}}, 1);
  set.begin(0, kinematics);
  set.begin_step(kinematics);
  EXPECT_FALSE(set.end_step(kinematics, 1));
  kinematics.X_WB[1].p = {-0.5, 0, 0};
  EXPECT_TRUE(set.end_step(kinematics, 1));
}

// Two balls at both ends of a step of 1 ms, which overlap by `before` and `after` [m] at these approach speeds [m/s].
bool is_watched_in_contact(double before, double speed_before, double after, double speed_after) {
  const ContactShape ball(primitive(Geometry::Shape::sphere, {0.1, 0, 0}));
  ContactSet set({{0, ball}, {1, ball}}, {{0, 1, elastic_law()}}, 1);
  const auto at = [](double overlap, double speed) {
    Kinematics kinematics;
    kinematics.X_WB = {Posed::identity(), {Rotationd::identity(), {0.2 - overlap, 0, 0}}};
    kinematics.V_WB = {Twistd::zero(), {Vector3d::zero(), {-speed, 0, 0}}};
    return kinematics;
  };
  set.begin(0, at(before, speed_before));
  set.begin_step(at(before, speed_before));
  const bool watched = set.end_step(at(after, speed_after), 1e-3);
  const double margin = set.margin(0, at(after, speed_after));
  EXPECT_TRUE(watched ? std::abs(margin - after) < 1e-12 : std::isinf(margin)) << margin;
  return watched;
}

TEST(ContactWatch, PairsWhoseContactMayEndAreWatched) {
  EXPECT_FALSE(is_watched_in_contact(1e-3, 0, 1e-3, 0));            // at rest
  EXPECT_FALSE(is_watched_in_contact(0, 1, 0.9e-3, 0.8));           // contact begins
  EXPECT_FALSE(is_watched_in_contact(0.9e-3, 0.8, 0.9e-3, -0.8));   // the deepest overlap is within the step
  EXPECT_TRUE(is_watched_in_contact(0.1e-3, 0.8, 0.1e-3, -0.8));    // likewise, but the overlaps are small
  EXPECT_TRUE(is_watched_in_contact(0.9e-3, -0.8, -0.1e-3, -1));    // contact has ended
  EXPECT_TRUE(is_watched_in_contact(0.2e-3, -0.8, 0.2e-3, 0.8));    // contact has probably ended and begun again
  EXPECT_TRUE(is_watched_in_contact(0.2e-3, -0.01, 0.19e-3, 0.9));  // only the acceleration at the end shows it
}

// As PairsThatAreNotWatchedStayApartThroughoutTheStep. The second body moves apart and is accelerated back.
TEST(ContactWatch, PairsThatAreNotWatchedTouchThroughoutTheStep) {
  int clear = 0, watched = 0, parted = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(9000 + i);
    const CaseShape kinds[] = {CaseShape::sphere, CaseShape::capsule, CaseShape::box, CaseShape::half_space};
    const ContactShape a = random_contact_shape(kinds[i % 3], random), b = random_contact_shape(kinds[i % 4], random);
    const Posed X_WA{random.rotation(), random.vector(1)};
    ContactSet set({{0, a}, {1, b}}, {{0, 1, elastic_law()}}, 1);
    Kinematics begin;
    begin.X_WB = {X_WA, overlapping_pose(a, b, X_WA, 1e-2, random)};
    begin.V_WB = {{random.vector(0.1), random.vector(0.1)}, {random.vector(0.1), random.vector(0.1)}};
    const Vector3d away = set.separation(0, begin).normal;
    const double speed = random.uniform(0, 0.4);
    begin.V_WB[1].linear += speed * away;
    set.begin(0, begin);
    for (const double duration : {0.01, 0.02, 0.05, 0.1, 0.2, 0.4}) {
      const double acceleration = random.uniform(1, 3) * speed / duration;
      const auto at = [&](double t) {
        Kinematics later = begin;
        for (int body = 0; body < 2; ++body) later.X_WB[body] = moved(begin.X_WB[body], begin.V_WB[body], t);
        later.X_WB[1].p -= (0.5 * acceleration * t * t) * away;
        later.V_WB[1].linear -= (acceleration * t) * away;
        return later;
      };
      double greatest = -std::numeric_limits<double>::infinity();
      for (int k = 0; k <= 50; ++k) greatest = std::max(greatest, set.separation(0, at(duration * k / 50)).distance);
      set.begin_step(begin);
      const bool is_watched = set.end_step(at(duration), duration);
      EXPECT_TRUE(is_watched || greatest < 0) << duration << ' ' << greatest;
      ++(is_watched ? watched : clear);
      parted += greatest >= 0;
    }
  }
  EXPECT_GT(clear, 50);
  EXPECT_GT(watched, 50);
  EXPECT_GT(parted, 10);
}

// Slip and deformation of a sphere that just touches another shape, and at a small distance.
TEST(ContactWatch, RatesOfASphereAreContinuousWhereContactBegins) {
  const CaseShape kinds[] = {CaseShape::sphere, CaseShape::capsule, CaseShape::cylinder,
                             CaseShape::box,    CaseShape::hull,    CaseShape::half_space};
  ContactLaw law = elastic_law();
  law.static_friction = 0.4, law.kinetic_friction = 0.3;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(8000 + i);
    const ContactShape a = random_contact_shape(CaseShape::sphere, random);
    const ContactShape b = random_contact_shape(kinds[i % 6], random);
    PairContact pair(a, b, law);
    MovingBody first{{random.rotation(), random.vector(1)}, {random.vector(1), random.vector(1)}};
    MovingBody second{overlapping_pose(a, b, first.X_WB, 1e-8, random), {random.vector(1), random.vector(1)}};
    const StickState stick{random.vector(0.3), 0.1};
    const ContactForce touching = pair.evaluate(first, second, stick);
    ASSERT_TRUE(touching.touches);
    second.X_WB.p += 2e-8 * pair.separation(first.X_WB, second.X_WB).normal;
    EXPECT_FALSE(pair.evaluate(first, second, stick).touches);
    const ContactForce& apart = pair.graze(first, second, stick);
    EXPECT_FALSE(apart.touches);
    EXPECT_EQ(apart.normal_force, 0);
    EXPECT_EQ(norm(apart.on_b.linear) + norm(apart.on_b.angular), 0);
    EXPECT_NEAR(apart.slip_speed, touching.slip_speed, 1e-5);
    const double rate = norm(touching.stick_rate.slip) + std::abs(touching.stick_rate.spin);
    EXPECT_GT(rate, 10);
    EXPECT_LT(norm(apart.stick_rate.slip - touching.stick_rate.slip), 1e-4 * rate);
    EXPECT_NEAR(apart.stick_rate.spin, touching.stick_rate.spin, 1e-4 * rate);
  }
}

}  // namespace
}  // namespace grapnel::testing::contact_energy
