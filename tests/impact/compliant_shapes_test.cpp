/// Contacts between shapes within a compliant impact: closed form, conservation, convergence, continuity.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "grapnel/impact/compliant_shapes.hpp"
#include "impact/compliant_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_shapes_test {

using Status = ImpactSolution::Status;

Geometry ball(double radius) {
  Geometry g;
  g.shape = Geometry::Shape::sphere, g.size = {radius, 0, 0};
  return g;
}
ContactMaterial linear(double stiffness) {
  ContactMaterial m;
  m.stiffness = stiffness;
  return m;
}

// ---- A mass between a spring and a wall ----

// A sphere moves at a speed v along x. A grasp connects its centre to a fixed robot; at a gap of 1 mm there is a wall.
struct SpringAndWall {
  static constexpr double mass = 3, speed = 0.2, gap = 1e-3, radius = 0.1, k = 2e4;
  Model model;
  State state;
  CompliantGrasp grasp;
  std::vector<ContactSurface> surfaces;
  std::vector<SurfacePair> pairs;
  double k_wall = 0;

  explicit SpringAndWall(double wall_stiffness) {
    ModelBuilder builder;
    BodyDescription robot = free_body("robot", 10, Symmetric3d::diagonal(1, 1, 1));
    robot.joint.type = JointType::fixed;
    builder.add(robot);
    builder.add(free_body("ball", mass, Symmetric3d::diagonal(0.02, 0.02, 0.02)));
    model = builder.build();
    state = zero_state(model);
    const Vector3d p{0.7, -0.4, 0.3};
    set_root_pose(model, 1, {Rotationd::identity(), p}, state);
    set_root_twist(model, 1, {Vector3d::zero(), {speed, 0, 0}}, state);
    grasp.grasp = {0, 1, GraspModel::point, p, {1, 0, 0}};
    grasp.linear_stiffness = k;
    const ContactMaterial material = linear(2 * wall_stiffness);
    const Posed X_WO{rotation_about({0, 1, 0}, -std::numbers::pi / 2), p + Vector3d{radius + gap, 0, 0}};
    surfaces = {{1, ContactShape(ball(radius))}, {-1, ContactShape::half_space(X_WO)}};
    pairs = {{0, 1, combine(material, material), 0}};
    k_wall = pairs[0].law.elastic;
  }

  // Displacement and velocity by the closed form: a vibration with the spring alone up to the gap, one with spring and
  // wall until the gap is reached again, with the opposite velocity, and so on.
  std::pair<double, double> at(double t) const {
    const double free_rate = std::sqrt(k / mass), rate = std::sqrt((k + k_wall) / mass);
    const double amplitude = speed / free_rate, reach = std::asin(gap / amplitude) / free_rate;
    const double v = speed * std::cos(free_rate * reach);
    const double centre = k_wall * gap / (k + k_wall), x = gap - centre;
    const double inside = 2 * std::atan2(v / rate, x) / rate;
    if (t < reach) return {amplitude * std::sin(free_rate * t), speed * std::cos(free_rate * t)};
    const double s = t - reach;
    if (s < inside)
      return {centre + x * std::cos(rate * s) + v / rate * std::sin(rate * s),
              -x * rate * std::sin(rate * s) + v * std::cos(rate * s)};
    const double phase = std::numbers::pi - free_rate * reach + free_rate * (s - inside);
    return {amplitude * std::sin(phase), speed * std::cos(phase)};
  }
};

TEST(CompliantShapes, AMassBetweenASpringAndAWallFollowsTheClosedForm) {
  const SpringAndWall c(1e5);
  ContactSet set(c.surfaces, c.pairs, 1);
  set.begin(10, forward_kinematics(c.model, c.state));
  ImpactShapes shapes{set, 10};
  const ImpactSolution o = compliant_impact(c.model, c.state, {}, {&c.grasp, 1}, {.longest = 0.03, .samples = 200}, {},
                                            {}, nullptr, &shapes);
  ASSERT_EQ(o.status, Status::time_over) << o.message;
  ASSERT_TRUE(shapes.touched);
  EXPECT_EQ(set.history(0).touches, 1);
  const double rate_free = std::sqrt(c.k / c.mass);
  EXPECT_NEAR(*set.history(0).first_time, 10 + std::asin(c.gap * rate_free / c.speed) / rate_free, 1e-12);
  Worst place("displacement"), rate("velocity");
  double contact_time = 0, deepest = 0;
  for (std::size_t i = 0; i < o.times.size(); ++i) {
    const auto [x, v] = c.at(o.times[i]);
    const Kinematics k = forward_kinematics(c.model, o.states[i]);
    place.note(std::abs(k.X_WB[1].p[0] - c.grasp.grasp.p_WC[0] - x) / c.gap, static_cast<int>(i));
    rate.note(std::abs(k.V_WB[1].linear[0] - v) / c.speed, static_cast<int>(i));
    deepest = std::max(deepest, x - c.gap);
    if (i > 0 && x > c.gap) contact_time += o.times[i] - o.times[i - 1];
  }
  EXPECT_LT(place.value(), 1e-9);
  EXPECT_LT(rate.value(), 1e-9);
  EXPECT_GT(contact_time, 0.003);  // most of the pulse lies within samples
  EXPECT_LT(o.energy_residual, 1e-10);
  EXPECT_LT(shapes.energy_error, 1e-10 * shapes.energy_exchanged);
  // The wall's impulse, by the loss of momentum less the spring's impulse.
  const double change = c.mass * (c.at(o.duration).second - c.speed);
  EXPECT_NEAR(shapes.impulses[0].on_b.linear[0], -(change + o.forces[0].impulse.linear[0]), 1e-9);
  EXPECT_NEAR(shapes.integrals[0].impulse, shapes.impulses[0].on_b.linear[0], 1e-9);
  EXPECT_NEAR(shapes.peaks[0].depth, deepest, 1e-2 * deepest);  // found at stages
  EXPECT_NEAR(shapes.peaks[0].force, c.k_wall * shapes.peaks[0].depth, 1e-9 * shapes.peaks[0].force);
}

// A hard wall: at the gap the velocity reverses, times the coefficient of restitution.
TEST(CompliantShapes, AHardWallReboundsInAnInstant) {
  SpringAndWall c(1e5);
  constexpr double e = 0.6;
  c.pairs[0].law.hard = true, c.pairs[0].law.restitution = e, c.pairs[0].law.rest_speed = 1e-3;
  ContactSet set(c.surfaces, c.pairs, 1);
  set.begin(0, forward_kinematics(c.model, c.state));
  ImpactShapes shapes{set, 0};
  const ImpactSolution o =
      compliant_impact(c.model, c.state, {}, {&c.grasp, 1}, {.longest = 0.02, .samples = 50}, {}, {}, nullptr, &shapes);
  ASSERT_EQ(o.status, Status::time_over) << o.message;
  EXPECT_EQ(set.history(0).impacts, 1);
  EXPECT_FALSE(set.touches());
  const double rate = std::sqrt(c.k / c.mass), amplitude = c.speed / rate, reach = std::asin(c.gap / amplitude) / rate;
  const double v = c.speed * std::cos(rate * reach), s = o.duration - reach;
  const Kinematics k = forward_kinematics(c.model, o.after);
  EXPECT_NEAR(k.X_WB[1].p[0] - c.grasp.grasp.p_WC[0], c.gap * std::cos(rate * s) - e * v / rate * std::sin(rate * s),
              1e-9 * c.gap);
  EXPECT_NEAR(k.V_WB[1].linear[0], -c.gap * rate * std::sin(rate * s) - e * v * std::cos(rate * s), 1e-9 * c.speed);
  EXPECT_NEAR(set.history(0).impact_impulse, (1 + e) * c.mass * v, 1e-9);
  EXPECT_NEAR(set.history(0).impact_loss, 0.5 * c.mass * v * v * (1 - e * e), 1e-10);
  EXPECT_NEAR(shapes.impulses[0].on_b.linear[0], (1 + e) * c.mass * v, 1e-9);
  EXPECT_LT(o.energy_residual, 1e-10);
}

TEST(CompliantShapes, WithoutATouchEveryBitIsThatWithoutShapes) {
  SpringAndWall c(1e5);
  set_root_twist(c.model, 1, {Vector3d::zero(), {0.05, 0.1, 0}}, c.state);  // 0.6 mm
  const CompliantSetup setup{.longest = 0.05, .samples = 50};
  const ImpactSolution alone = compliant_impact(c.model, c.state, {}, {&c.grasp, 1}, setup);
  ContactSet set(c.surfaces, c.pairs, 1);
  set.begin(0, forward_kinematics(c.model, c.state));
  ImpactShapes shapes{set, 0};
  const ImpactSolution o = compliant_impact(c.model, c.state, {}, {&c.grasp, 1}, setup, {}, {}, nullptr, &shapes);
  EXPECT_FALSE(shapes.touched);
  EXPECT_EQ(o.after.q, alone.after.q);
  EXPECT_EQ(o.after.v, alone.after.v);
  EXPECT_EQ(o.times, alone.times);
  EXPECT_EQ(o.steps, alone.steps);
  EXPECT_EQ(o.energy_residual, alone.energy_residual);
}

// ---- Free bodies ----

// A robot's body grasps a ball that rotates; the ball strikes a third body off its centre, with friction and damping.
struct ThreeBodies {
  Model model;
  State state;
  CompliantGrasp grasp;
  std::vector<ContactSurface> surfaces;
  std::vector<SurfacePair> pairs;

  ThreeBodies() {
    ModelBuilder builder;
    builder.add(free_body("robot", 40, Symmetric3d::diagonal(4, 5, 6)));
    builder.add(free_body("ball", 6, Symmetric3d::diagonal(0.05, 0.06, 0.07)));
    builder.add(free_body("third", 9, Symmetric3d::diagonal(0.1, 0.2, 0.15)));
    model = builder.build();
    state = zero_state(model);
    const Vector3d along{0.4, -0.2, 0.7}, p{4, -3, 2};
    set_root_pose(model, 0, {Rotationd::identity(), p - Vector3d{0.8, 0, 0.1}}, state);
    set_root_pose(model, 1, {Rotationd::identity(), p + Vector3d{0.1, 0, 0}}, state);
    set_root_pose(model, 2, {rotation_about({0.6, 0, 0.8}, 0.4), p + Vector3d{0.3462, 0.0293, 0.0391}}, state);
    set_root_twist(model, 0, {{0.01, 0.02, -0.03}, along + Vector3d{0.1, 0, 0}}, state);
    set_root_twist(model, 1, {{0.3, -0.2, 0.4}, along}, state);
    set_root_twist(model, 2, {{0, 0.1, 0}, along - Vector3d{0.1, 0.02, 0}}, state);
    grasp.grasp = {0, 1, GraspModel::rigid, p, {1, 0, 0}};
    grasp.linear_stiffness = 3e4, grasp.linear_damping = 60, grasp.angular_stiffness = 500, grasp.angular_damping = 1;
    ContactMaterial m = linear(4e4);
    m.dissipation = 2, m.static_friction = 0.4, m.kinetic_friction = 0.3;
    surfaces = {{1, ContactShape(ball(0.1))}, {2, ContactShape(ball(0.15))}};
    pairs = {{0, 1, combine(m, m), 0}};
  }

  struct Outcome {
    ImpactSolution o;
    double energy_error, energy_exchanged;
    ContactIntegrals integrals;
    int touches;
  };
  Outcome run(double tolerance, double longest = 0.1) const {
    ContactSet set(surfaces, pairs, 1);
    set.begin(0, forward_kinematics(model, state));
    ImpactShapes shapes{set, 0};
    ImpactSolution o = compliant_impact(model, state, {}, {&grasp, 1},
                                        {.longest = longest, .relative_tolerance = tolerance, .samples = 50}, {}, {},
                                        nullptr, &shapes);
    return {std::move(o), shapes.energy_error, shapes.energy_exchanged, shapes.integrals[0], set.history(0).touches};
  }
};

TEST(CompliantShapes, ConserveMomentumAndEnergyWithFriction) {
  const ThreeBodies c;
  for (const double tolerance : {1e-8, 1e-12}) {
    SCOPED_TRACE(tolerance);
    const ThreeBodies::Outcome r = c.run(tolerance);
    ASSERT_NE(r.o.status, Status::failed) << r.o.message;
    EXPECT_GE(r.touches, 1);
    EXPECT_GT(r.integrals.friction, 1e-6);
    EXPECT_GT(r.integrals.damping, 1e-6);
    EXPECT_LT(momentum_error(c.model, c.state, r.o.after), 1e-13);  // at any tolerance
    EXPECT_LT(r.o.energy_residual, tolerance > 1e-10 ? 1e-4 : 1e-8);
    EXPECT_LT(r.energy_error, (tolerance > 1e-10 ? 1e-4 : 1e-8) * r.energy_exchanged);
  }
}

TEST(CompliantShapes, ConvergeWithTheTolerance) {
  const ThreeBodies c;
  const State best = c.run(1e-13).o.after;
  double before = 1;
  for (const double tolerance : {1e-6, 1e-9, 1e-12}) {
    const State after = c.run(tolerance).o.after;
    double error = 0;
    for (std::size_t i = 0; i < best.v.size(); ++i) error = std::max(error, std::abs(after.v[i] - best.v[i]));
    EXPECT_LT(error, before) << tolerance;
    before = error;
  }
  EXPECT_LT(before, 1e-8);
}

// An impact that is cut in two at an instant of contact continues with the deformations of the first part.
TEST(CompliantShapes, ContinueWithTheirDeformationsInASecondImpact) {
  ThreeBodies c;
  c.grasp.linear_stiffness = 1e-3, c.grasp.linear_damping = 0;  // the second grasp begins unstressed: no influence
  c.grasp.angular_stiffness = 1e-5, c.grasp.angular_damping = 0;
  const ImpactSolution whole = c.run(1e-12, 0.04).o;
  ContactSet set(c.surfaces, c.pairs, 1);
  set.begin(0, forward_kinematics(c.model, c.state));
  State state = c.state;
  for (const double t : {0.0, 0.02}) {
    ImpactShapes shapes{set, t};
    CompliantGrasp grasp = c.grasp;
    const ImpactSolution part =
        compliant_impact(c.model, state, {}, {&grasp, 1}, {.longest = 0.02, .samples = 50}, {}, {}, nullptr, &shapes);
    ASSERT_NE(part.status, Status::failed) << part.message;
    if (t == 0) {
      EXPECT_TRUE(set.touches());
    }
    state = part.after;
  }
  EXPECT_EQ(set.history(0).touches, 1);
  for (std::size_t i = 0; i < state.v.size(); ++i) EXPECT_NEAR(state.v[i], whole.after.v[i], 1e-6);
}

}  // namespace compliant_shapes_test
}  // namespace grapnel::testing
