// Motions with contact against closed forms.

#include <gtest/gtest.h>

#include "contact/contact_cases.hpp"
#include "contact/free_bodies.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing::contact_motion {
namespace {

constexpr double kRadius = 0.05, kMass = 0.5, kModulus = 1e7;

ContactShape ball() { return ContactShape(primitive(Geometry::Shape::sphere, {kRadius, 0, 0})); }
ContactShape ground() { return ContactShape::half_space(Posed::identity()); }
ContactMaterial soft() {
  ContactMaterial m;
  m.modulus = 2 * kModulus;  // E* = kModulus between two of them
  return m;
}

// A ball that touches the ground at z = 0, with a speed downwards.
FreeBodies bouncing(const ContactMaterial& m, const Vector3d& v, const Vector3d& w = Vector3d::zero()) {
  FreeBodies s;
  s.bodies = {solid_sphere(kMass, kRadius, {0, 0, kRadius}), FreeBody{0}};
  s.bodies[0].v = v, s.bodies[0].w = w;
  s.links.push_back({0, 1, PairContact(ball(), ground(), combine(m, m))});
  return s;
}
double hertz_depth(double v) { return std::pow(15 * kMass * v * v / (16 * kModulus * std::sqrt(kRadius)), 0.4); }

// K. L. Johnson, Contact Mechanics, 1985, section 11.4: T = 2.94 depth / v = 2.87 (m^2 / (R E*^2 v))^(1/5).
TEST(ContactMotion, HertzImpactOfASphereOnAHalfSpaceHasItsDurationAndPeakForce) {
  const double v = 0.4, depth = hertz_depth(v), duration = 2.943276 * depth / v;
  EXPECT_NEAR(duration, 2.87 * std::pow(kMass * kMass / (kRadius * kModulus * kModulus * v), 0.2), 2e-3 * duration);
  FreeBodies s = bouncing(soft(), {0, 0, -v});
  const double h = duration / 2000;
  double peak = 0, deepest = 0, end = 0;
  for (int i = 1; i <= 2200; ++i) {
    const Vector3d before = s.bodies[0].p;
    s.step(h);
    const ContactForce& f = s.links[0].contact.evaluate(s.bodies[0].motion(), s.bodies[1].motion());
    peak = std::max(peak, f.normal_force), deepest = std::max(deepest, f.depth);
    const double z = s.bodies[0].p[2] - kRadius, z_before = before[2] - kRadius;
    if (end == 0 && z >= 0) end = h * (i - z / (z - z_before));
  }
  EXPECT_NEAR(end, duration, 1e-5 * duration);
  EXPECT_NEAR(deepest, depth, 1e-5 * depth);
  EXPECT_NEAR(peak, 4.0 / 3 * kModulus * std::sqrt(kRadius) * std::pow(depth, 1.5), 2e-5 * peak);
  EXPECT_NEAR(s.bodies[0].v[2], v, 1e-7);
}

TEST(ContactMotion, HuntCrossleyDissipationGivesTheCoefficientOfRestitution) {
  for (const double e : {0.95, 0.7, 0.3}) {
    for (const bool hertz : {true, false}) {
      ContactMaterial m = soft();
      if (!hertz) m.modulus = 0, m.stiffness = 2e4;
      const double v = 0.3;
      m.dissipation = dissipation_for(e, v);
      FreeBodies s = bouncing(m, {0, 0, -v});
      for (int i = 0; i < 6000; ++i) s.step(1e-5);
      EXPECT_NEAR(s.bodies[0].v[2], e * v, 1e-6) << e;
      EXPECT_NEAR(s.dissipated, 0.5 * kMass * v * v * (1 - e * e), 1e-7) << e;
    }
  }
}

// Slip throughout: the tangential impulse is mu times the normal one. Stick at the end: v' = 5/7 v + 2/7 R w.
TEST(ContactMotion, ReboundAngleAndSpinFollowFromFriction) {
  ContactMaterial m = soft();
  m.modulus = 2e9;  // shallow, so that the lever is the radius
  m.static_friction = m.kinetic_friction = 0.2, m.stiction_speed = 1e-3;
  m.stiction_displacement = 1e-6;  // small, so that contact slips or rolls as if rigid
  const double v = 0.2, impulse = 2 * kMass * v;
  {
    FreeBodies s = bouncing(m, {1.0, 0, -v});
    for (int i = 0; i < 3000; ++i) s.step(5e-7);
    EXPECT_NEAR(s.bodies[0].v[2], v, 1e-5);
    EXPECT_NEAR(s.bodies[0].v[0], 1.0 - 0.2 * impulse / kMass, 1e-5);
    EXPECT_NEAR(s.bodies[0].w[1], 2.5 * 0.2 * impulse / (kMass * kRadius), 2e-2);
  }
  {
    FreeBodies s = bouncing(m, {0.1, 0, -v}, {0, -1, 0});  // the surface moves with R w = 0.05 m/s along x
    for (int i = 0; i < 3000; ++i) s.step(5e-7);
    const double rolling = (5 * 0.1 - 2 * 0.05) / 7;
    EXPECT_NEAR(s.bodies[0].v[0], rolling, 1e-3);
    EXPECT_NEAR(s.bodies[0].w[1] * kRadius, rolling, 1e-3);
  }
}

constexpr double kGravity = 10;

// A box of 2 kg that nearly rests. `angle`: of the incline, downwards along x.
FreeBodies box_on_ground(const ContactMaterial& m, double angle = 0) {
  FreeBodies s;
  const Vector3d size{0.2, 0.3, 0.1};
  s.bodies = {solid_box(2, size, {0, 0, 0.05}), FreeBody{0}};
  s.gravity = {kGravity * std::sin(angle), 0, -kGravity * std::cos(angle)};
  s.links.push_back({0, 1, PairContact(ContactShape(primitive(Geometry::Shape::box, size)), ground(), combine(m, m))});
  return s;
}
ContactMaterial box_material(double friction, double dissipation, double damping) {
  ContactMaterial m;
  m.modulus = 1e6, m.dissipation = dissipation, m.damping = damping;
  m.static_friction = m.kinetic_friction = friction;
  return m;
}

// The damper ends the vibration about the weight's depth, which the dissipation of Hunt and Crossley alone does not
// (below).
TEST(ContactMotion, BoxSlidesToRestAfterTheDistanceOfCoulombFriction) {
  FreeBodies s = box_on_ground(box_material(0.3, 1, 600));
  for (int i = 0; i < 2000; ++i) s.step(2e-4);  // settles
  s.bodies[0].v = {0.5, 0, 0};
  const double x = s.bodies[0].p[0];
  for (int i = 0; i < 2000; ++i) s.step(2e-4);
  const double distance = 0.5 * 0.5 / (2 * 0.3 * kGravity);
  EXPECT_NEAR(s.bodies[0].p[0] - x, distance, 4e-3 * distance);
  EXPECT_LT(norm(s.bodies[0].v), 1e-12);
  EXPECT_NEAR(s.bodies[0].p[1], 0, 1e-9);
}

// m z'' = -k z (1 - a z') - m g vibrates about its rest with the damping rate a g / 2, for all masses and stiffnesses.
TEST(ContactMotion, VibrationOfARestingBoxDecaysWithTheRateOfHuntAndCrossley) {
  const double a = 1, mass = 2, stiffness = 0.5e6 / 0.05 * 0.06, rest = 0.05 - mass * kGravity / stiffness;
  FreeBodies s = box_on_ground(box_material(0, a, 0));
  s.bodies[0].p[2] = rest, s.bodies[0].v[2] = 1e-3;
  const auto amplitude = [&] {
    return std::hypot(s.bodies[0].v[2], std::sqrt(stiffness / mass) * (s.bodies[0].p[2] - rest));
  };
  const double before = amplitude();
  for (int i = 0; i < 5000; ++i) s.step(1e-4);
  EXPECT_NEAR(std::log(before / amplitude()) / 0.5, 0.5 * a * kGravity, 0.02 * 0.5 * a * kGravity);
}

TEST(ContactMotion, BoxRestsFlatWithoutRocking) {
  FreeBodies s = box_on_ground(box_material(0.3, 1, 600));
  s.bodies[0].q = quaternion_from(rotation_about({0.6, 0.8, 0}, 0.01));
  s.bodies[0].p[2] += 0.001;
  for (int i = 0; i < 5000; ++i) s.step(2e-4);
  const Rotationd R = rotation_matrix(s.bodies[0].q);
  EXPECT_LT(std::hypot(R(0, 2), R(1, 2)), 1e-9);
  double largest = 0;
  for (int i = 0; i < 2000; ++i) {
    s.step(2e-4);
    largest = std::max({largest, norm(s.bodies[0].v), norm(s.bodies[0].w)});
  }
  EXPECT_LT(largest, 1e-10);
}

// Below the friction angle a box rests without creep; above it the acceleration is g (sin - mu cos).
TEST(ContactMotion, BoxOnAnInclineRestsBelowTheFrictionAngleAndSlidesAboveIt) {
  const ContactMaterial m = box_material(0.3, 1, 600);
  FreeBodies resting = box_on_ground(m, std::atan(0.9 * 0.3));
  for (int i = 0; i < 10000; ++i) resting.step(2e-4);
  EXPECT_LT(norm(resting.bodies[0].v), 1e-10);
  const double angle = std::atan(1.2 * 0.3);
  FreeBodies sliding = box_on_ground(m, angle);
  for (int i = 0; i < 5000; ++i) sliding.step(2e-4);
  const double acceleration = kGravity * (std::sin(angle) - 0.3 * std::cos(angle));
  EXPECT_NEAR(sliding.bodies[0].v[0], acceleration, 0.01 * acceleration);
}

// Without rolling friction the speed stays.
TEST(ContactMotion, SphereRollsWithoutEnergyLoss) {
  ContactMaterial m = soft();
  m.static_friction = m.kinetic_friction = 0.3;
  const double depth = std::pow(kMass * kGravity * 0.75 / (kModulus * std::sqrt(kRadius)), 2.0 / 3);
  // The surface of contact is half of the depth above the ground.
  const double speed = 0.5, lever = kRadius - 0.5 * depth;
  FreeBodies s = bouncing(m, {speed, 0, 0}, {0, speed / lever, 0});
  s.bodies[0].p[2] -= depth, s.gravity = {0, 0, -kGravity};
  const double before = s.energy();
  for (int i = 0; i < 10000; ++i) s.step(1e-4);
  EXPECT_NEAR(s.bodies[0].p[0], speed, 1e-6);
  EXPECT_NEAR(s.bodies[0].v[0], speed, 1e-6);
  EXPECT_LT(s.dissipated, 1e-8 * before);
}

TEST(ContactMotion, NewtonsCradlePassesTheMomentumToTheLastSphere) {
  ContactMaterial m = soft();
  FreeBodies s;
  for (int i = 0; i < 4; ++i) s.bodies.push_back(solid_sphere(kMass, kRadius, {(2 * kRadius + 1e-3) * i, 0, 0}));
  s.bodies[0].v = {0.3, 0, 0};
  for (int i = 0; i < 3; ++i) s.links.push_back({i, i + 1, PairContact(ball(), ball(), combine(m, m))});
  for (int i = 0; i < 10000; ++i) s.step(1e-5);
  EXPECT_NEAR(s.bodies[3].v[0], 0.3, 0.002);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(s.bodies[i].v[0], 0, 0.002) << i;
  EXPECT_NEAR(s.linear_momentum()[0], kMass * 0.3, 1e-14);
}

ContactMaterial random_material(Random& random) {
  ContactMaterial m;
  m.modulus = random.log_uniform(3e4, 3e5), m.poisson_ratio = random.uniform(0, 0.5);
  m.dissipation = random.uniform(0, 1), m.damping = random.chance(0.5) ? random.uniform(0, 5) : 0;
  m.damping_depth = 3e-3;
  m.kinetic_friction = random.uniform(0, 0.5), m.static_friction = m.kinetic_friction * random.uniform(1, 1.5);
  m.stiction_speed = 0.2;
  m.rolling_length = random.uniform(0, 1e-3), m.torsional_length = random.uniform(0, 1e-3), m.stiction_rate = 0.2;
  return m;
}

TEST(ContactMotion, ThousandRandomPairsInFreeFlightConserveMomentumAndEnergy) {
  Worst linear("linear momentum, relative"), angular("angular momentum, relative"), energy("energy, relative");
  int touched = 0, dissipated = 0;
  for (int i = 0; i < test::repetitions(1000); ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    const auto shape = [&] { return random_contact_shape(kCaseShapes[random.integer(0, 4)], random); };
    const ContactShape a = shape(), b = shape();
    const Posed X_WA{random.rotation(), random.vector(0.5)};
    const Posed X_WB = overlapping_pose(a, b, X_WA, -1e-4, random);
    FreeBodies s;
    const auto body_at = [&](const Posed& X) {
      const double mass = random.uniform(0.5, 2);
      FreeBody free{mass, random_inertia(mass, 0.3, random), X.p, random.vector(0.2), random.vector(0.5)};
      free.q = quaternion_from(X.R);
      return free;
    };
    s.bodies = {body_at(X_WA), body_at(X_WB)};
    s.links.push_back({0, 1, PairContact(a, b, combine(random_material(random), random_material(random)))});
    // They approach each other.
    const ShapeSeparation gap = s.links[0].contact.separation(X_WA, X_WB);
    s.bodies[0].v += 0.3 * gap.normal, s.bodies[1].v -= 0.3 * gap.normal;
    const Vector3d p = s.linear_momentum(), l = s.angular_momentum();
    const double e = s.energy();
    for (int k = 0, free = 0; k < 250 && free < 10; ++k) {
      s.step(2e-4);
      free = s.dissipated > 0 && !s.links[0].contact.last().touches ? free + 1 : 0;
    }
    touched += s.dissipated > 0, dissipated += s.dissipated > 0.01 * e;
    const double scale = s.bodies[0].mass * norm(s.bodies[0].v) + s.bodies[1].mass * norm(s.bodies[1].v);
    EXPECT_LT(linear.note(norm(s.linear_momentum() - p) / scale, i), 1e-12);
    EXPECT_LT(angular.note(norm(s.angular_momentum() - l) / scale, i), 1e-6);  // of the integrator; per metre
    EXPECT_LT(energy.note(std::abs(s.energy() + s.dissipated - e) / e, i), 1e-3);
  }
  EXPECT_GT(touched, test::repetitions(900));
  EXPECT_GT(dissipated, test::repetitions(500));
}

// Elastic boxes that tumble against each other: the energy error is that of the integrator, so it vanishes with its
// step. An inconsistent gradient would leave an error that does not.
TEST(ContactMotion, EnergyErrorOfElasticContactVanishesWithTheStep) {
  const auto error = [](double step) {
    FreeBodies s;
    const Vector3d size{0.2, 0.3, 0.1};
    s.bodies = {solid_box(1, size, {0, 0, 0}), solid_box(1, size, {0.02, 0.03, 0.17})};
    s.bodies[1].q = quaternion_from(rotation_about({0.6, 0.8, 0}, 0.5));
    s.bodies[0].w = {0.3, -0.4, 0.2}, s.bodies[1].v = {0.05, 0.02, -0.5};
    const ContactShape box(primitive(Geometry::Shape::box, size));
    s.links.push_back({0, 1, PairContact(box, box, elastic_law())});
    const double before = s.energy();
    double largest = 0;
    bool touched = false;
    for (int k = 0; k < static_cast<int>(0.1 / step + 0.5); ++k) {
      s.step(step);
      touched = touched || s.links[0].contact.last().touches;
      if (k % 8 == 0) largest = std::max(largest, std::abs(s.energy() / before - 1));
    }
    EXPECT_TRUE(touched);
    return largest;
  };
  const double coarse = error(4e-5), fine = error(1e-5);
  std::printf("[ measured ] energy error, step 4e-5 s and 1e-5 s: %.3g %.3g\n", coarse, fine);
  EXPECT_LT(coarse, 1e-9);        // measured 8e-11
  EXPECT_LT(fine, 0.1 * coarse);  // measured 3e-13
}

}  // namespace
}  // namespace grapnel::testing::contact_motion
