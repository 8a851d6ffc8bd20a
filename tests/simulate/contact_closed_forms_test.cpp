/// Motions with contact against closed forms: a spinning top, and two balls with friction.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulate/hard_scene.hpp"

namespace grapnel::testing {
namespace contact_closed_forms_test {

constexpr double kGravity = 10;

ContactLaw linear_law(double stiffness, double friction = 0, double stiction_displacement = 1e-4) {
  ContactMaterial m;
  m.stiffness = 2 * stiffness;
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

}  // namespace contact_closed_forms_test
}  // namespace grapnel::testing
