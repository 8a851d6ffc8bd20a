/// Impacts of hard contacts in a phase: closed forms of balls and boxes, simultaneous contacts, and the rule for
/// contact that lasts.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "simulate/hard_scene.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace hard_contact_test {

constexpr double kRadius = 0.1, kMass = 2;

HardScene ball_on_floor(double restitution, double friction) {
  HardScene s({hard_ball("ball", kMass, kRadius)});
  s.shape(0, sphere_of(kRadius));
  s.pair(0, -1, hard_law(restitution, friction));
  return s;
}

// A ball with spin meets the floor obliquely. Its contact point has the tangential mobility 7/(2 m): it slides if
// friction cannot stop the slip u, otherwise it sticks.
TEST(HardContact, ASpinningBallSlidesOrSticks) {
  const double v_n = 0.8, e = 0.6, gap = 0.05;
  const Vector3d v{0.5, 0.1, -v_n}, w{1, -3, 2};
  const Vector3d slip{v[0] - kRadius * w[1], v[1] + kRadius * w[0], 0};  // v + w x (-r z)
  Worst worst("velocity after an oblique impact");
  for (const double mu : {0.0, 0.02, 0.1, 0.5}) {
    HardScene s = ball_on_floor(e, mu);
    s.place(0, {0, 0, kRadius + gap}, v, w);
    const PhaseOutcome outcome = s.run(0.2);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const double P_n = kMass * v_n * (1 + e), P_stick = 2.0 / 7 * kMass * norm(slip);
    const bool sticks = mu * P_n >= P_stick;
    EXPECT_EQ(sticks, mu > 0.2);
    const Vector3d P_t = -(sticks ? P_stick : mu * P_n) / norm(slip) * slip;
    const Vector3d v_after{v[0] + P_t[0] / kMass, v[1] + P_t[1] / kMass, e * v_n};
    const double I = 0.4 * kMass * kRadius * kRadius;
    const Vector3d w_after = w + (1 / I) * cross(Vector3d{0, 0, -kRadius}, P_t);
    const Twistd V = s.twist(outcome.end_state, 0);
    EXPECT_LT(worst.note(norm(V.linear - v_after), 0), 1e-12);  // measured 2e-15
    EXPECT_LT(worst.note(norm(V.angular - w_after), 1), 1e-11);
    const GroupHistory& history = s.history();
    EXPECT_EQ(history.impacts, 1);
    EXPECT_FALSE(history.persistent_since);
    EXPECT_NEAR(*history.first_time, gap / v_n, 1e-12);
    EXPECT_NEAR(history.impact_impulse, P_n, 1e-12);
    EXPECT_NEAR(history.impact_loss, 0.5 * kMass * v_n * v_n * (1 - e * e), 1e-12);
    EXPECT_NEAR(history.impact_work, -history.impact_loss - history.impact_friction_loss, 1e-12);
    EXPECT_NEAR(s.energy(s.state) - s.energy(outcome.end_state), history.impact_loss + history.impact_friction_loss,
                1e-12);
  }
}

TEST(HardContact, TwoFreeBallsExchangeMomentum) {
  HardScene s({hard_ball("a", 2, 0.1), hard_ball("b", 3, 0.15)});
  s.shape(0, sphere_of(0.1)), s.shape(1, sphere_of(0.15));
  const double e = 0.7;
  s.pair(0, 1, hard_law(e));
  s.place(0, {-1, 0, 0}, {0.5, 0, 0});
  s.place(1, {0, 0, 0}, {-0.1, 0, 0});
  const PhaseOutcome outcome = s.run(2);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  const double reduced = 2.0 * 3 / 5, P = reduced * 0.6 * (1 + e);
  EXPECT_NEAR(*s.history().first_time, 0.75 / 0.6, 1e-10);
  EXPECT_NEAR(s.twist(outcome.end_state, 0).linear[0], 0.5 - P / 2, 1e-13);
  EXPECT_NEAR(s.twist(outcome.end_state, 1).linear[0], -0.1 + P / 3, 1e-13);
  EXPECT_NEAR(s.history().fastest_impact, 0.6, 1e-13);
  EXPECT_NEAR(norm(s.momentum(outcome.end_state).linear - s.momentum(s.state).linear), 0, 1e-14);
}

// Bounces follow each other at times 2 v e^k / g. Contact lasts from the impact after which the ball would be slower
// than rest_speed; the limit of all bounces is later by the rest of the geometric series.
TEST(HardContact, ABouncingBallComesToRest) {
  const double e = 0.7, g = 9.81, height = 0.3;
  HardScene s = ball_on_floor(e, 0);
  s.setup.gravity = {0, 0, -g};
  s.place(0, {0, 0, kRadius + height});
  const double t1 = std::sqrt(2 * height / g), v1 = g * t1, rest = hard_law(e).rest_speed;
  int n = 0;
  double at = t1;
  for (double v = v1 * e; ++n, v >= rest; v *= e) at += 2 * v / g;
  const double limit = t1 + 2 * v1 * e / (g * (1 - e)), remainder = 2 * v1 * std::pow(e, n) / (g * (1 - e));
  EXPECT_NEAR(at, limit - remainder, 1e-12);
  const PhaseOutcome outcome = s.run(limit + 1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  const GroupHistory& history = s.history();
  EXPECT_EQ(history.impacts, n);
  ASSERT_TRUE(history.persistent_since);
  EXPECT_NEAR(*history.persistent_since, at, 1e-9);
  EXPECT_TRUE(history.since);  // it touches
  EXPECT_LT(norm(s.twist(outcome.end_state, 0).linear), 1e-8);
  EXPECT_NEAR(s.position(outcome.end_state, 0)[2], kRadius - kMass * g / 1e6, 1e-9);
  // Each impact takes the same fraction of the energy.
  EXPECT_NEAR(history.impact_loss, 0.5 * kMass * v1 * v1 * (1 - std::pow(e, 2 * n)), 1e-9);
}

TEST(HardContact, APlasticImpactStays) {
  HardScene s = ball_on_floor(0, 0.3);
  s.setup.gravity = {0, 0, -1.62};
  s.place(0, {0, 0, kRadius + 0.5}, {0.2, 0, 0});
  const PhaseOutcome outcome = s.run(1.2);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_EQ(s.history().impacts, 1);
  EXPECT_NEAR(*s.history().persistent_since, std::sqrt(1 / 1.62), 1e-10);
  EXPECT_LT(std::abs(s.twist(outcome.end_state, 0).linear[2]), 1e-8);
  // It rolls: the impact stops the slip.
  const Twistd V = s.twist(outcome.end_state, 0);
  EXPECT_NEAR(V.linear[0], 5.0 / 7 * 0.2, 1e-4);
  EXPECT_NEAR(V.linear[0], kRadius * V.angular[1], 1e-4);
}

// At rest at gap zero, without and with weight.
TEST(HardContact, BallsAtRestThatTouchStayAtRest) {
  for (const double g : {0.0, 9.81}) {
    HardScene s = ball_on_floor(0.5, 0.2);
    s.setup.gravity = {0, 0, -g};
    s.place(0, {0, 0, kRadius});
    const PhaseOutcome outcome = s.run(1);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    EXPECT_EQ(s.history().impacts, 0);
    EXPECT_NEAR(s.position(outcome.end_state, 0)[2], kRadius - kMass * g / 1e6, 1e-9);
    EXPECT_TRUE(s.history().since);  // contact without force if there is no weight
  }
}

// ---- Several points and several pairs simultaneously ----

TEST(HardContact, ABoxFallsFlatOnFourPoints) {
  const Vector3d size{0.4, 0.6, 0.2};
  const double e = 0.5, g = 2, gap = 0.1;
  HardScene s({hard_box("box", 5, size)});
  s.shape(0, hard_shape(Geometry::Shape::box, size));
  s.pair(0, -1, hard_law(e, 0.3));
  s.setup.gravity = {0, 0, -g};
  s.place(0, {0, 0, 0.5 * size[2] + gap});
  const double t1 = std::sqrt(2 * gap / g), v1 = g * t1;
  const PhaseOutcome outcome = s.run(t1 + 0.1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_EQ(s.history().impacts, 1);
  EXPECT_NEAR(s.history().impact_impulse, 5 * v1 * (1 + e), 1e-10);
  const Twistd V = s.twist(outcome.end_state, 0);
  EXPECT_NEAR(V.linear[2], e * v1 - g * 0.1, 1e-10);
  EXPECT_LT(norm(V.angular), 1e-10);
}

// The same with friction for rotated boxes, whose tangential rates are rounding errors.
TEST(HardContact, FlatFallsOfRotatedBoxesAreNotDisturbedByRounding) {
  const Vector3d size{0.4, 0.6, 0.2};
  const double e = 0.5, v = 0.7;
  Worst worst("velocity after a flat fall");
  for (int k = 0; k < 40; ++k) {
    HardScene s({hard_box("box", 1 + 0.3 * k, size)});
    s.shape(0, hard_shape(Geometry::Shape::box, size));
    s.pair(0, -1, hard_law(e, 0.05 + 0.02 * k));
    s.place(0, {0.1 * k, -0.2 * k, 0.5 * size[2] + 0.05}, {0, 0, -v}, Vector3d::zero(),
            rotation_about({0, 0, 1}, 0.37 * k));
    const PhaseOutcome outcome = s.run(0.1);
    ASSERT_TRUE(outcome.finished) << k << ": " << outcome.failure;
    ASSERT_EQ(s.history().impacts, 1) << k;
    const Twistd V = s.twist(outcome.end_state, 0);
    worst.note(norm(V.linear - Vector3d{0, 0, e * v}), k);
    worst.note(norm(V.angular), k);
  }
  EXPECT_LT(worst.value(), 1e-10);
}

// A tilted box meets the floor with an edge of two points: the closed form of one central point at the distance d.
TEST(HardContact, ABoxFallsOnAnEdge) {
  const Vector3d size{0.4, 0.6, 0.2};
  const double e = 0.8, tilt = 0.3, mass = 5, v = 0.7;
  HardScene s({hard_box("box", mass, size)});
  s.shape(0, hard_shape(Geometry::Shape::box, size));
  s.pair(0, -1, hard_law(e));
  s.place(0, {0, 0, 1}, {0, 0, -v}, Vector3d::zero(), rotation_about({0, 1, 0}, tilt));
  const PhaseOutcome outcome = s.run(1.3);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  ASSERT_EQ(s.history().impacts, 1);
  // Lowest edge: x = +size_x/2, z = -size_z/2 in the box; its distance from the centre along x in W.
  const double d = 0.5 * (size[0] * std::cos(tilt) - size[2] * std::sin(tilt));
  const double height = 0.5 * (size[0] * std::sin(tilt) + size[2] * std::cos(tilt));
  const double I = mass * (size[0] * size[0] + size[2] * size[2]) / 12, P = (1 + e) * v / (1 / mass + d * d / I);
  EXPECT_NEAR(*s.history().first_time, (1 - height) / v, 1e-10);
  const Twistd V = s.twist(outcome.end_state, 0);
  EXPECT_NEAR(V.linear[2], -v + P / mass, 1e-11);
  EXPECT_NEAR(V.angular[1], -d * P / I, 1e-10);
  EXPECT_NEAR(V.angular[0], 0, 1e-10);
}

// Boxes that slip, or meet the floor with an edge, have a solution for every coefficient of friction; energy falls.
TEST(HardContact, BoxesSlipOnEdgesAndFaces) {
  const Vector3d size{0.4, 0.6, 0.2};
  for (int k = 0; k < 40; ++k) {
    const bool edge = k % 2 == 0;
    HardScene s({hard_box("box", 1 + 0.3 * k, size)});
    s.shape(0, hard_shape(Geometry::Shape::box, size));
    s.pair(0, -1, hard_law(0.02 * k, 0.05 + 0.02 * k));
    const Rotationd R = rotation_about({0, 0, 1}, 0.37 * k) * rotation_about({0, 1, 0}, edge ? 0.3 + 0.01 * k : 0.0);
    const double height = edge ? 0.4 : 0.5 * size[2] + 0.05;
    s.place(0, {0.1 * k, -0.2 * k, height}, {0.05 * k, 0.2, -0.7}, {0, 0, edge ? 0.0 : 0.5}, R);
    const PhaseOutcome outcome = s.run(edge ? 0.4 : 0.1);
    ASSERT_TRUE(outcome.finished) << k << ": " << outcome.failure;
    EXPECT_GE(s.history().impacts, 1) << k;
    EXPECT_GT(s.history().impact_friction_loss, 0) << k;
    EXPECT_NEAR(s.history().impact_work, -s.history().impact_loss - s.history().impact_friction_loss,
                1e-11 * s.energy(s.state))
        << k;
  }
}

// Balls in a row that touch: the simultaneous law is that of equal springs of infinitesimal size, which differs from a
// sequence of collisions. An independent integration of the chain of springs gives its result.
std::array<double, 3> chain_of_springs(double v) {
  std::array<double, 6> y{0, 0, 0, v, 0, 0};
  const auto rate = [](const std::array<double, 6>& s) {
    const double f12 = std::max(0.0, s[0] - s[1]), f23 = std::max(0.0, s[1] - s[2]);
    return std::array<double, 6>{s[3], s[4], s[5], -f12, f12 - f23, f23};
  };
  const double h = 2e-4;
  const auto moved = [&](const std::array<double, 6>& k, double step) {
    std::array<double, 6> z = y;
    for (int i = 0; i < 6; ++i) z[i] += step * k[i];
    return z;
  };
  for (int n = 0; n < 30000; ++n) {
    const auto k1 = rate(y), k2 = rate(moved(k1, h / 2)), k3 = rate(moved(k2, h / 2)), k4 = rate(moved(k3, h));
    for (int i = 0; i < 6; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return {y[3], y[4], y[5]};
}

TEST(HardContact, BallsInARowAreStruckSimultaneously) {
  HardScene s({hard_ball("1", kMass, kRadius), hard_ball("2", kMass, kRadius), hard_ball("3", kMass, kRadius)});
  for (int i = 0; i < 3; ++i) s.shape(i, sphere_of(kRadius));
  s.pair(0, 1, hard_law(1)), s.pair(1, 2, hard_law(1));
  const double v = 0.5;
  s.place(0, {-0.5, 0, 0}, {v, 0, 0}), s.place(1, {0, 0, 0}), s.place(2, {2 * kRadius, 0, 0});
  const PhaseOutcome outcome = s.run(1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  const std::array<double, 3> expected = chain_of_springs(v);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(s.twist(outcome.end_state, i).linear[0], expected[i], 1e-7) << i;
  EXPECT_LT(expected[0], -0.05 * v);  // a sequence of collisions would stop it
  EXPECT_EQ(s.history(0).impacts, 1);
  EXPECT_EQ(s.history(1).impacts, 1);
  EXPECT_NEAR(s.energy(outcome.end_state), s.energy(s.state), 1e-13);
}

// The same balls with gaps: one collision after the other, and the last ball leaves with the speed of the first.
TEST(HardContact, BallsWithGapsAreStruckOneAfterTheOther) {
  HardScene s({hard_ball("1", kMass, kRadius), hard_ball("2", kMass, kRadius), hard_ball("3", kMass, kRadius)});
  for (int i = 0; i < 3; ++i) s.shape(i, sphere_of(kRadius));
  s.pair(0, 1, hard_law(1)), s.pair(1, 2, hard_law(1));
  s.place(0, {-0.5, 0, 0}, {0.5, 0, 0}), s.place(1, {0, 0, 0}), s.place(2, {2 * kRadius + 1e-6, 0, 0});
  const PhaseOutcome outcome = s.run(1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_NEAR(s.twist(outcome.end_state, 0).linear[0], 0, 1e-12);
  EXPECT_NEAR(s.twist(outcome.end_state, 1).linear[0], 0, 1e-12);
  EXPECT_NEAR(s.twist(outcome.end_state, 2).linear[0], 0.5, 1e-12);
}

// ---- Contact that lasts ----

// Plates that move as prescribed squeeze a ball: without the rule its bounces would accumulate.
TEST(HardContact, ASqueezedBallComesToLastingContact) {
  SKIP_UNDER_SANITIZERS();
  const Symmetric3d I = Symmetric3d::diagonal(1, 1, 1);
  HardScene s({hard_body("ground", 1, I, JointType::fixed), hard_body("left", 1, I, JointType::prismatic, "ground"),
               hard_body("right", 1, I, JointType::prismatic, "ground"), hard_ball("ball", kMass, kRadius)});
  const Geometry plate = hard_shape(Geometry::Shape::box, {0.1, 1, 1});
  s.shape(1, plate), s.shape(2, plate), s.shape(3, sphere_of(kRadius));
  s.pair(1, 3, hard_law(0.95, 0.1, 1e5)), s.pair(2, 3, hard_law(0.95, 0.1, 1e5));
  const double speed = 0.02, gap = 0.02;
  s.setup.drives.resize(2);
  const auto drive = [&](int joint, double from, double rate) {
    const Body& body = s.model.joint_body(joint);
    s.state.q[body.q] = from, s.state.v[body.v] = rate;
    s.setup.drives[joint].control = JointControl::prescribed;
    s.setup.drives[joint].trajectory = interpolate_samples(std::array{0.0, 2.0}, std::array{from, from + 2 * rate});
  };
  drive(0, -0.05 - kRadius - gap, speed), drive(1, 0.05 + kRadius + gap, -speed);
  s.place(3, {0, 0, 0}, {0.1, 0, 0});
  const PhaseOutcome outcome = s.run(1.02);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_GT(s.history(0).impacts, 5);
  EXPECT_LT(s.history(0).impacts + s.history(1).impacts, 500);
  EXPECT_TRUE(s.history(0).persistent_since);
  EXPECT_TRUE(s.history(1).persistent_since);
  EXPECT_NEAR(s.position(outcome.end_state, 3)[0], 0, 1e-3);
}

}  // namespace hard_contact_test
}  // namespace grapnel::testing
