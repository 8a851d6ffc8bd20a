// Closed forms of forces and energies, separation, allocation, sets of pairs.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "contact/contact_cases.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/contact/few_corners.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "support/allocation_trap.hpp"

namespace grapnel::testing::contact_geometry {
namespace {

using Shape = Geometry::Shape;
const Twistd kRest = Twistd::zero();
Posed at(double x, double y, double z) { return {Rotationd::identity(), {x, y, z}}; }
ContactShape box(double x, double y, double z) { return ContactShape(primitive(Shape::box, {x, y, z})); }
ContactShape ground() { return ContactShape::half_space(Posed::identity()); }

// The field of a box of half height H over ground of the same E: K = E / H of each, K / 2 together. At the equal
// pressure K (depth / 2) the surface is a rectangle smaller than the face, with four strips at 45 degrees or steeper.
TEST(ContactGeometry, BoxOnAHalfSpaceHasTheForceOfItsFaceAndACentralMoment) {
  PairContact pair(box(0.2, 0.3, 0.1), ground(), elastic_law());
  const ContactLaw law = elastic_law();
  const double depth = 1e-5, slope = law.elastic / 0.05;
  const ContactForce& f = pair.evaluate({at(1, 2, 0.05 - depth), kRest}, {Posed::identity(), kRest});
  const double force = slope * depth * 0.06;
  EXPECT_NEAR(f.on_a.linear[2], force, 3e-4 * force);
  EXPECT_NEAR(norm(shift(f.on_a, Vector3d{1, 2, 0} - f.p_WC).angular), 0, 1e-12 * force);
  EXPECT_NEAR(f.depth, depth, 1e-12);
  EXPECT_NEAR(pair.elastic_energy(at(1, 2, 0.05 - depth), Posed::identity()), 0.5 * force * depth,
              3e-4 * force * depth);
  EXPECT_FALSE(f.beyond_model);
}

// A box on its edge: at both faces a strip from the ground's plane to the plane of symmetry, where depths below face
// and ground are in the inverse ratio of the pressures' slopes. The outer edges, whose middles have a twelfth of the
// area, have no pressure, or that of a rounding error: of either sign in the various frames.
TEST(ContactGeometry, AreaIncludesEdgesWithoutPressure) {
  const ContactLaw law = elastic_law();
  PairContact pair(box(0.1, 0.2, 0.1), ground(), law);
  const double depth = 1e-5, ratio = law.elastic_a / law.elastic_b;
  const Posed X_WA{rotation_about({0, 1, 0}, 0.25 * std::numbers::pi), {0, 0, 0.05 * std::numbers::sqrt2 - depth}};
  const double strips = 2 * 0.2 * depth * std::hypot(1, ratio / (std::numbers::sqrt2 + ratio));
  Random random(3);
  for (int i = 0; i < 40; ++i) {
    const Posed X_FW{random.rotation(), random.vector(1)};
    const ContactForce& f = pair.evaluate({X_FW * X_WA, kRest}, {X_FW, kRest});
    EXPECT_NEAR(f.area, strips, 1e-4 * strips) << i;  // measured 2e-6, at the box's ends
  }
}

TEST(ContactGeometry, HullOfABoxHasTheForceOfTheBox) {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? 0.1 : -0.1, i & 2 ? 0.15 : -0.15, i & 4 ? 0.05 : -0.05});
  PairContact hulls(ContactShape(hull_geometry(corners)), ground(), elastic_law());
  PairContact boxes(box(0.2, 0.3, 0.1), ground(), elastic_law());
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Posed X_WA = at(0.1, 0, 0);
    const Posed X = overlapping_pose(box(0.2, 0.3, 0.1), ground(), X_WA, 1e-3, random);
    const ContactForce a = hulls.evaluate({X_WA, kRest}, {X, kRest}), b = boxes.evaluate({X_WA, kRest}, {X, kRest});
    EXPECT_NEAR(norm(a.on_a.linear - b.on_a.linear), 0, 1e-8 * b.normal_force);
  }
}

// Buoyancy of a standing and of a lying cylinder.
TEST(ContactGeometry, CylinderOnAHalfSpaceHasTheForceOfItsSubmergedVolume) {
  const double r = 0.1, half = 0.15, depth = 1e-3;
  PairContact pair(ContactShape(primitive(Shape::cylinder, {r, 2 * half, 0})), ground(), elastic_law());
  const double slope = elastic_law().elastic / r;
  const ContactForce standing = pair.evaluate({at(0, 0, half - depth), kRest}, {Posed::identity(), kRest});
  EXPECT_NEAR(standing.normal_force, slope * M_PI * r * r * depth, 1e-9 * standing.normal_force);
  EXPECT_NEAR(standing.area, M_PI * r * r, 1e-9);
  const Posed lying{rotation_about({1, 0, 0}, M_PI / 2), {0, 0, r - depth}};
  const ContactForce side = pair.evaluate({lying, kRest}, {Posed::identity(), kRest});
  const double angle = std::acos(1 - depth / r), segment = r * r * (angle - std::sin(angle) * std::cos(angle));
  EXPECT_NEAR(side.normal_force, slope * segment * 2 * half, 1e-8 * side.normal_force);
}

TEST(ContactGeometry, SphereOnAHalfSpaceHasHertzsForce) {
  PairContact pair(ContactShape(primitive(Shape::sphere, {0.1, 0, 0})), ground(), elastic_law());
  const ContactForce& f = pair.evaluate({at(0, 0, 0.1 - 1e-4), kRest}, {Posed::identity(), kRest});
  EXPECT_NEAR(f.normal_force, 4.0 / 3 * elastic_law().elastic * std::sqrt(0.1) * 1e-6, 1e-9 * f.normal_force);
  EXPECT_NEAR(f.depth, 1e-4, 1e-15);
}

// A ball slides along x and spins about the normal. The deformation turns with the mean rate of both bodies and lags
// the slip by 12.5 rad/s * 0.1 mm / (0.1 m/s) = 0.0125 rad; friction must not.
TEST(ContactGeometry, FrictionOfASpinningBodyIsOppositeToItsSlip) {
  ContactLaw law = elastic_law();
  law.static_friction = law.kinetic_friction = 0.3;
  PairContact pair(ContactShape(primitive(Shape::sphere, {0.1, 0, 0})), ground(), law);
  const Twistd sliding{{0, 0, 25}, {0.1, 0, 0}};
  StickState chi;
  for (int i = 0; i < 2000; ++i) {  // 20 ms with steps of 1/20 of the relaxation time
    const ContactForce& f = pair.evaluate({at(0, 0, 0.1 - 1e-4), sliding}, {Posed::identity(), kRest}, chi);
    chi.slip += 1e-5 * f.stick_rate.slip, chi.spin += 1e-5 * f.stick_rate.spin;
  }
  const ContactForce& f = pair.evaluate({at(0, 0, 0.1 - 1e-4), sliding}, {Posed::identity(), kRest}, chi);
  EXPECT_NEAR(std::abs(std::atan2(chi.slip[1], -chi.slip[0])), 0.0125, 5e-4);
  EXPECT_NEAR(f.on_a.linear[0], -0.3 * f.normal_force, 1e-4 * f.normal_force);
  EXPECT_LT(std::abs(f.on_a.linear[1]), 1e-4 * f.normal_force);  // 0.03 with the delay of sticking bodies
}

TEST(ContactGeometry, LyingCapsuleHasTheForceOfACylinderPerLength) {
  PairContact pair(ContactShape(primitive(Shape::capsule, {0.1, 0.4, 0})), ground(), elastic_law());
  const double depth = 1e-8, line = M_PI / 4 * elastic_law().elastic * 0.4 * depth;
  // An exact quarter turn: the angle pi/2 in double precision would be tilted by 6e-17.
  const Posed lying{{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}}, {0, 0, 0.1 - depth}};
  const ContactForce& f = pair.evaluate({lying, kRest}, {Posed::identity(), kRest});
  EXPECT_NEAR(f.normal_force, line, 5e-3 * line);  // the ends add 4/3 E* sqrt(R) depth^1.5 each
  EXPECT_NEAR(f.p_WC[1], 0, 1e-16);
  // Tilted by less than depth over half length: the centre of the forces moves by tilt * length^2 / (12 depth).
  for (const double tilt : {6.123e-17, 1e-10, 1e-8}) {
    const Posed tilted{rotation_about({1, 0, 0}, tilt) * lying.R, lying.p};
    const double center = pair.evaluate({tilted, kRest}, {Posed::identity(), kRest}).p_WC[1];
    EXPECT_NEAR(std::abs(center), tilt * 0.16 / (12 * depth), 1e-2 * tilt * 0.16 / (12 * depth) + 1e-9);
  }
}

// At the places where the axis enters and leaves the other shape, the derivative of the squared distance vanishes as
// well.
TEST(ContactGeometry, CapsuleWithItsAxisInsideIsBeyondTheModel) {
  for (const CaseShape kind : {CaseShape::cylinder, CaseShape::box}) {
    int flagged = 0;
    for (int i = 0; i < 100; ++i) {
      Random random(i);
      const ContactShape b = random_contact_shape(kind, random);
      const Posed X_WB{random.rotation(), random.vector(1)};
      // The axis passes near the middle of B, which is at least 0.05 m inside, with one end or none in B.
      const Posed X_WA{random.rotation(), X_WB * b.X_BC().p + random.vector(0.01)};
      const Posed X_WA_moved{X_WA.R, X_WA.p + random.uniform(-0.45, 0.45) * X_WA.R.column(2)};
      PairContact pair(ContactShape(primitive(Shape::capsule, {0.02, 1, 0})), b, elastic_law());
      flagged += pair.evaluate({X_WA_moved, kRest}, {X_WB, kRest}).beyond_model;
    }
    EXPECT_EQ(flagged, 100) << name_of(kind);
  }
}

TEST(ContactGeometry, SeparationHasTheDistanceAndTheNearestPoints) {
  const PairContact pair(box(0.2, 0.2, 0.2), ContactShape(primitive(Shape::sphere, {0.1, 0, 0})), elastic_law());
  const ShapeSeparation s = pair.separation(at(0, 0, 0), at(0.5, 0.05, 0));
  EXPECT_NEAR(s.distance, 0.3, 1e-14);
  EXPECT_NEAR(s.normal[0], 1, 1e-14);
  EXPECT_NEAR(norm(s.point_a - Vector3d{0.1, 0.05, 0}), 0, 1e-13);
  EXPECT_NEAR(norm(s.point_b - Vector3d{0.4, 0.05, 0}), 0, 1e-13);
}

TEST(ContactGeometry, BroadPhaseIsTightAndNeverMissesAContact) {
  const PairContact board(box(2, 0.2, 0.02), ground(), elastic_law());
  EXPECT_GT(board.gap_bound(at(0, 0, 0.0101), Posed::identity()), 0);
  EXPECT_LT(board.gap_bound(at(0, 0, 0.0099), Posed::identity()), 0);
  const PairContact boards(box(2, 0.2, 0.02), box(2, 0.2, 0.02), elastic_law());
  EXPECT_GT(boards.gap_bound(at(0, 0, 0), at(0, 0, 0.0201)), 0);
  int touching = 0;
  for (int i = 0; i < 2000; ++i) {
    Random random(i);
    const ContactShape a = random_contact_shape(kCaseShapes[random.integer(0, 3)], random);
    const ContactShape b = random_contact_shape(kCaseShapes[random.integer(0, 3)], random);
    const PairContact pair(a, b, elastic_law());
    const Posed X_WA{random.rotation(), random.vector(1)}, X_WB{random.rotation(), X_WA.p + random.vector(0.4)};
    const bool touches = pair.separation(X_WA, X_WB).distance <= 0;
    touching += touches;
    EXPECT_TRUE(!touches || pair.gap_bound(X_WA, X_WB) <= 0) << i;
  }
  EXPECT_GT(touching, 200);
}

TEST(ContactGeometry, SupportMapFindsTheFarthestVertexInEveryDirection) {
  Random random(5);
  const Geometry g = ellipsoid_hull(1000, 0.3, random);
  const SupportMap map(g.mesh->hull, {1, -2, 0.5});
  for (int i = 0; i < 20000; ++i) {
    Vector3d d = random.direction();
    if (i % 3 == 0) d[random.integer(0, 2)] = 0;
    double farthest = -1e300;
    for (const Vector3d& v : map.vertices()) farthest = std::max(farthest, dot(d, v));
    EXPECT_EQ(dot(d, map.support(d)), farthest);
  }
}

#if defined(GRAPNEL_CUT_IN_REGISTERS)

using Corners = std::vector<std::array<double, 2>>;

Corners part_inside(const Corners& polygon, double c, double a, double b) {
  Corners inside;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::array<double, 2>&p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at_p = c + a * p[0] + b * p[1], at_q = c + a * q[0] + b * q[1];
    if (at_p >= 0) inside.push_back(p);
    if ((at_p >= 0) == (at_q >= 0)) continue;
    const double part = at_p / (at_p - at_q);
    inside.push_back({p[0] + part * (q[0] - p[0]), p[1] + part * (q[1] - p[1])});
  }
  return inside;
}

double area_of(const Corners& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::array<double, 2>&p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return 0.5 * twice;
}

TEST(ContactGeometry, PolygonsInRegistersAreCutAsCornerByCorner) {
  Random random(6);
  int cut = 0, large = 0;
  for (int i = 0; i < 3000; ++i) {
    Corners corners(static_cast<std::size_t>(random.integer(3, 8)));
    std::vector<double> angles;
    for (std::size_t k = 0; k < corners.size(); ++k) angles.push_back(random.uniform(0, 2 * std::numbers::pi));
    std::sort(angles.begin(), angles.end());
    for (std::size_t k = 0; k < corners.size(); ++k) corners[k] = {std::cos(angles[k]), 2 * std::sin(angles[k])};
    alignas(64) double s[8], t[8];
    for (std::size_t k = 0; k < 8; ++k) {
      const std::array<double, 2>& p = corners[k < corners.size() ? k : 0];
      s[k] = p[0], t[k] = p[1];
    }
    few_corners::Polygon polygon{_mm512_load_pd(s), _mm512_load_pd(t), static_cast<unsigned>(corners.size())};
    const double c = random.uniform(-1.5, 1.5), a = random.uniform(-1, 1), b = random.uniform(-1, 1);
    const Corners inside = part_inside(corners, c, a, b);
    const few_corners::Rest rest = few_corners::clip(polygon, c, a, b);
    if (rest == few_corners::Rest::unknown) {
      EXPECT_GT(inside.size(), 8u);
      ++large;
      continue;
    }
    ASSERT_EQ(rest == few_corners::Rest::some, !inside.empty());
    if (inside.empty()) continue;
    if (inside != corners) ++cut;
    ASSERT_EQ(polygon.corners, inside.size());
    double pairs[16];
    few_corners::store(polygon, pairs);
    Corners found;
    for (std::size_t k = 0; k < 8; ++k) {
      if (k < inside.size()) {
        found.push_back({pairs[2 * k], pairs[2 * k + 1]});
      } else {
        EXPECT_EQ(pairs[2 * k], pairs[0]);
      }
    }
    EXPECT_NEAR(area_of(found), area_of(inside), 1e-13);
  }
  EXPECT_GT(cut, 500);
  EXPECT_GT(large, 20);
}

#endif

TEST(ContactGeometry, EvaluationDoesNotAllocate) {
  for (const CaseShape a : kCaseShapes) {
    for (const CaseShape b : kCaseShapes) {
      if (a == CaseShape::half_space) continue;
      Random random(static_cast<int>(a) * 10 + static_cast<int>(b));
      const ContactShape shape_a = random_contact_shape(a, random), shape_b = random_contact_shape(b, random);
      if (shape_b.kind() < shape_a.kind()) continue;
      PairContact pair(shape_a, shape_b, elastic_law());
      const Posed X_WA{random.rotation(), random.vector(1)};
      const Posed X_WB = overlapping_pose(shape_a, shape_b, X_WA, 2e-3, random);
      AllocationTrap trap;
      const bool touches = pair.evaluate({X_WA, kRest}, {X_WB, kRest}).touches;
      EXPECT_EQ(trap.stop(), 0) << name_of(a) << " " << name_of(b);
      EXPECT_TRUE(touches) << name_of(a) << " " << name_of(b);
    }
  }
}

TEST(ContactGeometry, TwoHalfSpacesAndInvalidShapesAreRefused) {
  EXPECT_THROW(PairContact(ground(), ground(), elastic_law()), std::invalid_argument);
  EXPECT_THROW(ContactShape(Geometry{}), std::invalid_argument);
  EXPECT_THROW(box(0.1, 0, 0.1), std::invalid_argument);
}

TEST(ContactGeometry, SetSumsThePairsOfAModel) {
  ContactMaterial m;
  m.modulus = 1e6;
  const ContactLaw law = combine(m, m);
  const ContactSurface ball{0, ContactShape(primitive(Shape::sphere, {0.1, 0, 0}))};
  const ContactSurface block{1, box(0.2, 0.2, 0.2)}, floor{-1, ground()};
  ContactSet set({ball, block, floor}, {{0, 1, law}, {0, 2, law}, {1, 2, law}}, 1);
  Kinematics kinematics;
  kinematics.X_WB = {at(0, 0, 0.2), at(0.199, 0, 0.2)};
  kinematics.V_WB = {kRest, kRest};
  std::vector<ExternalWrench> wrenches;
  set.begin(0, kinematics);
  set.evaluate(kinematics, wrenches);
  ASSERT_EQ(wrenches.size(), 2u);
  EXPECT_LT(wrenches[0].F_W.linear[0], 0);
  EXPECT_EQ(wrenches[0].F_W.linear[0], -wrenches[1].F_W.linear[0]);
  EXPECT_TRUE(set.group(0).touches);
  EXPECT_EQ(set.mode(0), ContactSet::Mode::touching);
  EXPECT_EQ(set.mode(1), ContactSet::Mode::apart);
  EXPECT_NEAR(set.margin(0, kinematics), 1e-3, 1e-15);
  EXPECT_GT(set.elastic_energy(0, kinematics), 0);
  EXPECT_NEAR(set.separation(1, kinematics).distance, 0.1, 1e-15);
  EXPECT_THROW(ContactSet({ball, ball}, {{0, 1, law}}, 1), std::invalid_argument);
  EXPECT_THROW(ContactSet({ball, block}, {{0, 2, law}}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace grapnel::testing::contact_geometry
