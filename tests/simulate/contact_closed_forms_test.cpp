/// Motions and forces of contacts against closed forms: a spinning top, two balls with friction, a clamp with a wedge.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulate/hard_scene.hpp"

namespace grapnel::testing {
namespace contact_closed_forms_test {

constexpr double kGravity = 10;
const Symmetric3d kUnit = Symmetric3d::diagonal(1, 1, 1);

ContactLaw linear_law(double stiffness, double friction = 0, double stiction_displacement = 1e-4, double damping = 0) {
  ContactMaterial m;
  m.stiffness = 2 * stiffness, m.damping = 2 * damping;
  m.static_friction = m.kinetic_friction = friction, m.stiction_displacement = stiction_displacement;
  return combine(m, m);
}

// A symmetric top on a smooth plane: its centre of mass rests and its axis precesses with the rate W of
// I1 W^2 cos(a) - I3 w3 W + m g l = 0.
TEST(ContactClosedForms, ATopOnASmoothPlanePrecessesSteadily) {
  const double mass = 0.5, I1 = 1e-3, I3 = 5e-4, length = 0.05, radius = 0.01, stiffness = 1e4;
  const double spin = 200, tilt = 0.4, half = 0.5 * I3 * spin;
  const double moment = mass * kGravity * length, flat = I1 * std::cos(tilt);
  const double rate = (half - std::sqrt(half * half - flat * moment)) / flat;
  HardScene s({hard_body("top", mass, Symmetric3d::diagonal(I1, I1, I3))});
  Geometry tip = sphere_of(radius);
  tip.X_BG.p = {0, 0, -length};
  s.shape(0, tip), s.pair(0, -1, linear_law(stiffness));
  s.setup.gravity = {0, 0, -kGravity};
  const Vector3d axis{std::sin(tilt), 0, std::cos(tilt)}, up{0, 0, 1};
  const Vector3d p{0, 0, length * std::cos(tilt) + radius - mass * kGravity / stiffness};
  s.place(0, p, Vector3d::zero(), rate * up + (spin - rate * std::cos(tilt)) * axis, rotation_about({0, 1, 0}, tilt));
  const double duration = 2;
  const PhaseOutcome end = s.run(duration);
  ASSERT_TRUE(end.finished) << end.failure;
  const Kinematics k = forward_kinematics(s.model, end.end_state);
  const double angle = rate * duration;
  EXPECT_GT(angle, 4);
  const Vector3d expected{std::sin(tilt) * std::cos(angle), std::sin(tilt) * std::sin(angle), std::cos(tilt)};
  EXPECT_LT(norm(k.X_WB[0].R * up - expected), 1e-9);
  EXPECT_LT(norm(k.X_WB[0].p - p), 1e-10);
}

// Two equal balls, one at rest, at 45 degrees: elastic along the normal, and Coulomb's impulse along the surface, since
// contact slides throughout.
TEST(ContactClosedForms, BallsThatStrikeEachOtherObliquelyExchangeCoulombsImpulse) {
  const double mass = 0.5, radius = 0.05, friction = 0.1, speed = 1, part = speed / std::numbers::sqrt2;
  HardScene s({hard_ball("first", mass, radius), hard_ball("second", mass, radius)});
  s.shape(0, sphere_of(radius)), s.shape(1, sphere_of(radius));
  s.pair(0, 1, linear_law(1e9, friction, 1e-7));
  const Vector3d normal{std::sqrt(0.5), -std::sqrt(0.5), 0}, along{std::sqrt(0.5), std::sqrt(0.5), 0};
  s.place(0, {0, 0, 0}, {speed, 0, 0}), s.place(1, (2 * radius + 1e-9) * normal);
  const PhaseOutcome end = s.run(1e-3);
  ASSERT_TRUE(end.finished) << end.failure;
  EXPECT_EQ(s.history().touches, 1);
  const Twistd a = s.twist(end.end_state, 0), b = s.twist(end.end_state, 1);
  const double bound = 1e-3 * speed;  // the normal turns by slip over diameter, about 3e-4
  EXPECT_NEAR(dot(a.linear, normal), 0, bound);
  EXPECT_NEAR(dot(b.linear, normal), part, bound);
  EXPECT_NEAR(dot(a.linear, along), part - friction * part, bound);
  EXPECT_NEAR(dot(b.linear, along), friction * part, bound);
  const double turn = friction * part * 2.5 / radius;
  EXPECT_NEAR(std::abs(a.angular[2]), turn, 2e-3 * turn);
  EXPECT_NEAR(a.angular[2], b.angular[2], 1e-6);
}

// ---- A jaw with a wedge surface closes on a flange ----

constexpr double kStiffness = 2e4, kRadius = 0.05, kClosing = 50;

// The jaw slides along x and is pulled towards -x; its surface is inclined by `angle` to this direction, and presses
// the round edge of a flange, which slides along z, on its seat, the floor.
struct Clamp {
  Clamp(double angle, double friction)
      : s({ground(), slide("jaw", {1, 0, 0}, angle), slide("flange", {0, 0, 1}, angle)}) {
    Geometry wedge = hard_shape(Geometry::Shape::box, {0.4, 0.4, 0.1});
    const Vector3d normal{-std::sin(angle), 0, -std::cos(angle)};  // of the surface, towards the flange
    wedge.X_BG = {rotation_about({0, 1, 0}, std::numbers::pi + angle),
                  Vector3d{0, 0, kRadius} - (kRadius + 0.05) * normal};
    Geometry edge = sphere_of(kRadius);
    edge.X_BG.p = {0, 0, kRadius};
    s.shape(1, wedge), s.shape(2, edge);
    s.pair(2, 1, linear_law(kStiffness, friction, 3e-6, 50)), s.pair(2, -1, linear_law(kStiffness, 0, 1e-4, 50));
  }
  static BodyDescription ground() { return hard_body("ground", 1, kUnit, JointType::fixed); }
  // Dampers of the joints bring both to rest without overshoot, which would reverse friction; springs are negligible.
  static BodyDescription slide(const std::string& name, const Vector3d& axis, double angle) {
    BodyDescription d = hard_body(name, 1, kUnit, JointType::prismatic, "ground");
    d.joint.axis = axis, d.joint.spring = JointSpring{1e-6, 4 * std::sqrt(kStiffness) * std::tan(angle), 0, 0};
    return d;
  }

  // Force on the seat at rest, after the closing force has acted for 10 s, and then for `open` seconds without it.
  double seat_force(double open = 0) {
    ExternalLoad pull;
    pull.body = 1, pull.amplitude.linear = {-kClosing, 0, 0}, pull.profile.end = 10;
    s.setup.loads = {pull};
    const PhaseOutcome end = s.run(10 + open);
    EXPECT_TRUE(end.finished) << end.failure;
    speed = norm(s.twist(end.end_state, 1).linear);
    return -kStiffness * s.position(end.end_state, 2)[2];
  }

  HardScene s;
  double speed = 0;  // of the jaw at the end [m/s]
};

constexpr double kDegree = std::numbers::pi / 180;

TEST(ContactClosedForms, AWedgeWithoutFrictionMultipliesTheClosingForce) {
  for (const double degrees : {10.0, 20.0, 30.0, 45.0, 60.0}) {
    Clamp clamp(degrees * kDegree, 0);
    const double expected = kClosing / std::tan(degrees * kDegree);
    EXPECT_NEAR(clamp.seat_force(), expected, 1e-8 * expected) << degrees;
    EXPECT_LT(clamp.speed, 1e-9) << degrees;
  }
}

// F / tan(angle + friction angle).
TEST(ContactClosedForms, FrictionReducesTheForceOfAWedge) {
  for (const double degrees : {10.0, 20.0, 30.0, 45.0}) {
    for (const double friction : {0.1, 0.4}) {
      Clamp clamp(degrees * kDegree, friction);
      const double expected = kClosing / std::tan(degrees * kDegree + std::atan(friction));
      EXPECT_NEAR(clamp.seat_force(), expected, 1e-3 * expected) << degrees << " " << friction;
    }
  }
}

// Without closing force a wedge of less than the friction angle remains closed. Contact sticks, so the force on the
// seat follows from its elasticity and that of the wedge; a wider wedge is expelled.
TEST(ContactClosedForms, AWedgeLocksItselfBelowTheFrictionAngle) {
  const double friction = 0.4, angle = 10 * kDegree, c = std::cos(angle), s = std::sin(angle);
  const double normal = kClosing / (s + friction * c), closed = normal * (c - friction * s);
  const double retreat = (normal / c - closed) / (kStiffness * (c / s + 1 / (s * c)));
  Clamp locked(angle, friction);
  EXPECT_NEAR(locked.seat_force(10), closed + kStiffness * retreat * c / s, 1e-2 * closed);
  EXPECT_LT(locked.speed, 1e-9);

  Clamp opened(30 * kDegree, friction);
  EXPECT_LT(std::abs(opened.seat_force(10)), 1e-3 * kClosing);
}

// ---- A finger slides out and back as prescribed, within one step ----

constexpr double kReach = 0.1, kBall = 0.05;

// A light finger on a heavy base, with `gap` between its ball and a free one. After a rest of 1 s, its position is
// kReach (1 - x^2)^2 with -1 <= x <= 1 in 0.2 s: its rate and acceleration are zero at both ends.
struct Finger {
  Finger(double gap, JointType base) : s({hard_body("base", 1e9, kUnit, base), finger(), hard_ball("ball", 1, kBall)}) {
    s.shape(1, sphere_of(kBall)), s.shape(2, sphere_of(kBall));
    s.pair(1, 2, linear_law(1e4));
    s.place(2, {2 * kBall + gap, 0, 0});
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory.segments = {{0, 1, ChebyshevSegment{{0}}},
                                 {1, 1.2, ChebyshevSegment{{0.375 * kReach, 0, -0.5 * kReach, 0, 0.125 * kReach}}},
                                 {1.2, 2, ChebyshevSegment{{0}}}};
    s.setup.drives = {drive};
  }
  static BodyDescription finger() {
    return hard_body("finger", 1e-12, Symmetric3d::diagonal(1e-15, 1e-15, 1e-15), JointType::prismatic, "base");
  }
  HardScene s;
};

TEST(ContactClosedForms, APrescribedFingerMeetsABallWithinAStep) {
  for (const JointType base : {JointType::free, JointType::fixed}) {
    Finger near(0.9 * kReach, base);
    const PhaseOutcome end = near.s.run(2);
    ASSERT_TRUE(end.finished) << end.failure;
    EXPECT_EQ(near.s.history().touches, 1);
    EXPECT_GT(near.s.twist(end.end_state, 2).linear[0], 0.1);

    Finger far(1.1 * kReach, base);
    ASSERT_TRUE(far.s.run(2).finished);
    EXPECT_EQ(far.s.history().touches, 0);
  }
}

// Steps in which the finger cannot reach the ball need no search, so watching it costs no evaluation.
TEST(ContactClosedForms, APrescribedFingerIsNotSearchedFarFromTheBall) {
  Finger scene(50 * kReach, JointType::fixed);
  const PhaseOutcome watched = scene.s.run(2);
  ASSERT_TRUE(watched.finished) << watched.failure;
  Finger alone(50 * kReach, JointType::fixed);
  alone.s.pairs.clear();
  const PhaseOutcome end = alone.s.run(2);
  ASSERT_TRUE(end.finished) << end.failure;
  EXPECT_GT(end.rhs_evaluations, 30);
  EXPECT_LE(watched.rhs_evaluations, end.rhs_evaluations + 3);
}

}  // namespace contact_closed_forms_test
}  // namespace grapnel::testing
