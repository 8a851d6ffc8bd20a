/// Contacts between shapes in a phase: closed forms, conservation, and modes.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace contact_phase_test {

using Shape = Geometry::Shape;
constexpr double kRadius = 0.1, kMass = 2;

Geometry primitive(Shape shape, const Vector3d& size) {
  Geometry g;
  g.shape = shape, g.size = size;
  return g;
}
BodyDescription free_body(const std::string& name, double mass, const Symmetric3d& inertia) {
  BodyDescription d;
  d.name = name, d.mass = mass, d.inertia = inertia;
  d.joint.type = JointType::free, d.joint.name = name + "_root";
  return d;
}
BodyDescription ball(const std::string& name, double mass = kMass, double radius = kRadius) {
  const double I = 0.4 * mass * radius * radius;
  return free_body(name, mass, Symmetric3d::diagonal(I, I, I));
}
ContactLaw linear_law(double stiffness) {
  ContactMaterial m;
  m.stiffness = 2 * stiffness;
  return combine(m, m);
}

Model model_of(const std::vector<BodyDescription>& bodies) {
  ModelBuilder builder;
  for (const BodyDescription& body : bodies) builder.add(body);
  return builder.build();
}

// Bodies with one shape each, and the floor z <= 0 as the last surface.
struct Scene {
  explicit Scene(const std::vector<BodyDescription>& bodies) : model(model_of(bodies)), state(zero_state(model)) {}

  void add(const Geometry& shape) { surfaces.push_back({static_cast<int>(surfaces.size()), ContactShape(shape)}); }
  void add_floor() { surfaces.push_back({-1, ContactShape::half_space(Posed::identity())}); }
  void pair(int a, int b, const ContactLaw& law) { pairs.push_back({a, b, law, static_cast<int>(pairs.size())}); }
  void place(int body, const Vector3d& p, const Twistd& V = Twistd::zero()) {
    set_root_pose(model, body, {Rotationd::identity(), p}, state);
    set_root_twist(model, body, V, state);
  }
  PhaseOutcome run(double duration, const PhaseObservers& observers = {}) {
    contacts = std::make_shared<ContactSet>(surfaces, pairs, static_cast<int>(pairs.size()));
    PhaseSetup setup;
    setup.gravity = gravity;
    setup.contacts = contacts;
    setup.loads = loads;
    dynamics = std::make_unique<PhaseDynamics>(model, setup);
    IntegrationSetup integration;
    integration.relative_tolerance = integration.absolute_tolerance = tolerance;
    return simulate_phase(*dynamics, {state, 0, duration}, integration, observers);
  }
  double elastic_energy(const State& at) {
    const Kinematics k = forward_kinematics(model, at);
    double sum = 0;
    for (std::size_t g = 0; g < contacts->groups(); ++g) sum += contacts->elastic_energy(g, k);
    return sum;
  }

  Model model;
  State state;
  std::vector<ContactSurface> surfaces;
  std::vector<SurfacePair> pairs;
  Vector3d gravity = Vector3d::zero();
  std::vector<ExternalLoad> loads;
  double tolerance = 1e-13;
  std::shared_ptr<ContactSet> contacts;
  std::unique_ptr<PhaseDynamics> dynamics;
};

Twistd moving(const Vector3d& v, const Vector3d& w = Vector3d::zero()) { return {w, v}; }
Vector3d place_of(const Scene& scene, const State& state, int body) {
  return forward_kinematics(scene.model, state).X_WB[body].p;
}
Twistd twist_of(const Scene& scene, const State& state, int body) {
  return forward_kinematics(scene.model, state).V_WB[body];
}

// Each accepted step takes twelve evaluations, each rejected one eleven; events would take three more.
TEST(ContactPhase, PairsThatStayFarApartNeedNoSearchForEvents) {
  Scene s({free_body("box", 2, Symmetric3d::diagonal(0.01, 0.02, 0.025)), ball("ball")});
  s.add(primitive(Shape::box, {0.2, 0.2, 0.2})), s.add(primitive(Shape::sphere, {kRadius, 0, 0}));
  s.pair(0, 1, linear_law(1e4));
  s.place(0, {0, 0, 0}, moving({0.1, 0, 0}, {1, 2, 3})), s.place(1, {3, 0, 0}, moving({0, 0.1, 0}));
  s.tolerance = 1e-10;
  const PhaseOutcome outcome = s.run(1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_GE(outcome.steps, 3);
  EXPECT_EQ(outcome.rhs_evaluations, 2 + 12 * outcome.steps + 11 * outcome.rejected);
}

// A ball without friction keeps its slip velocity, from the first to the last instant of the contact.
// While the balls are apart, the integrals of their contact and of the impulses on them are named as constant.
TEST(ContactPhase, OnlyConstantNumbersAreLeftByTheIntegrator) {
  for (const double gravity : {0.0, -0.1}) {
    Scene s({ball("first"), ball("second")});
    s.gravity = {0, 0, gravity};
    for (int i = 0; i < 2; ++i) s.add(primitive(Shape::sphere, {kRadius, 0, 0}));
    s.place(0, {0, 0, 0}), s.place(1, {0.3, 0, 0}, {{0, 0, 1}, {-1, 0, 0}});
    s.pair(0, 1, linear_law(1e3));
    const PhaseOutcome outcome = s.run(0.05);
    ASSERT_TRUE(outcome.finished);
    const std::vector<double> y = s.dynamics->initial(outcome.end_state, 0.05);
    std::vector<double> rates(y.size());
    (*s.dynamics)(0.05, y, rates);
    std::vector<NumberRange> still;
    s.dynamics->still(still);
    int count = 0;
    for (const NumberRange& range : still) {
      for (int i = range.begin; i < range.end; ++i, ++count) EXPECT_EQ(rates[i], 0) << i;
    }
    // Of the contact five and its deformation four; without gravity external work and impulses, in all and of each
    // tree.
    EXPECT_EQ(count, gravity == 0 ? 9 + 7 + 2 * 7 : 9);
    s.run(0.11);
    ASSERT_TRUE(s.contacts->touches());
    still.clear();
    s.dynamics->still(still);
    EXPECT_TRUE(still.empty());
  }
}

TEST(ContactPhase, SlipBeginsAndEndsWithTheContactWithoutShortSteps) {
  Scene s({ball("ball")});
  s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add_floor();
  const double k = 1e4, v = 0.3, along = 0.5;
  s.pair(0, 1, linear_law(k));
  s.place(0, {0, 0, kRadius + 0.05}, moving({along, 0, -v}));
  s.tolerance = 1e-11;
  const PhaseOutcome outcome = s.run(0.4);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_NEAR(outcome.integrals.contacts[0].slip, along * M_PI / std::sqrt(k / kMass), 1e-9);
  EXPECT_LE(outcome.steps, 25);
  EXPECT_LE(outcome.rejected, 6);
}

// A linear spring: half a period of contact, and the speed reversed.
TEST(ContactPhase, LinearBallReboundsAfterHalfAPeriod) {
  Scene s({ball("ball")});
  s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add_floor();
  const double k = 1e4, v = 0.3, gap = 0.05;
  s.pair(0, 1, linear_law(k));
  s.place(0, {0, 0, kRadius + gap}, moving({0, 0, -v}));
  const double omega = std::sqrt(k / kMass), contact = M_PI / omega, end = 0.4;
  const PhaseOutcome outcome = s.run(end);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_NEAR(twist_of(s, outcome.end_state, 0).linear[2], v, 1e-11);
  EXPECT_NEAR(place_of(s, outcome.end_state, 0)[2], kRadius + v * (end - gap / v - contact), 1e-11);
  const GroupHistory& history = s.contacts->history(0);
  EXPECT_EQ(history.touches, 1);
  EXPECT_NEAR(*history.first_time, gap / v, 1e-12);
  EXPECT_NEAR(history.duration, contact, 1e-10);
  ASSERT_EQ(outcome.integrals.contacts.size(), 1u);
  EXPECT_NEAR(outcome.integrals.contacts[0].impulse, 2 * kMass * v, 1e-11);
  EXPECT_NEAR(outcome.integrals.contacts[0].work, 0, 1e-11);
}

// A ball at rest on the floor with gap zero falls into its equilibrium.
TEST(ContactPhase, BallAtGapZeroUnderGravityOscillates) {
  Scene s({ball("ball")});
  s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add_floor();
  const double k = 1e4, g = 9.81;
  s.pair(0, 1, linear_law(k));
  s.gravity = {0, 0, -g};
  s.place(0, {0, 0, kRadius});
  const double omega = std::sqrt(k / kMass), t = 0.0123;
  const PhaseOutcome outcome = s.run(t);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_NEAR(place_of(s, outcome.end_state, 0)[2], kRadius - kMass * g / k * (1 - std::cos(omega * t)), 1e-12);
  EXPECT_EQ(s.contacts->mode(0), ContactSet::Mode::touching);
}

// Two free balls collide off centre: momentum, and energy with the elastic part, are conserved.
TEST(ContactPhase, FreeBodiesConserveMomentumAndEnergy) {
  Scene s({ball("a"), ball("b", 3, 0.15)});
  s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add(primitive(Shape::sphere, {0.15, 0, 0}));
  ContactMaterial m;
  m.modulus = 1e7, m.static_friction = 0.3, m.kinetic_friction = 0.2, m.dissipation = 0.5;
  s.pair(0, 1, combine(m, m));
  s.place(0, {-0.4, 0.05, 0}, moving({0.5, 0, 0}, {0, 0, 3}));
  s.place(1, {0, 0, 0.02}, moving({-0.1, 0.02, 0}, {0, 1, 0}));
  const auto totals = [&](const State& state) {
    return momentum_about(s.model, forward_kinematics(s.model, state), Vector3d::zero());
  };
  const auto energy = [&](const State& state) {
    return kinetic_energy(s.model, forward_kinematics(s.model, state), state);
  };
  const Momentumd before = totals(s.state);
  const double energy_before = energy(s.state);
  const PhaseOutcome outcome = s.run(1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  EXPECT_EQ(s.contacts->history(0).touches, 1);
  const Momentumd after = totals(outcome.end_state);
  EXPECT_LT(norm(after.linear - before.linear), 1e-11);    // measured 2.1e-12
  EXPECT_LT(norm(after.angular - before.angular), 1e-11);  // measured 1e-12
  const ContactIntegrals& contact = outcome.integrals.contacts[0];
  EXPECT_GT(contact.friction, 1e-4);
  EXPECT_GT(contact.damping, 1e-4);
  EXPECT_NEAR(energy(outcome.end_state), energy_before - contact.friction - contact.damping, 1e-11);
  EXPECT_NEAR(contact.work, -contact.friction - contact.damping, 1e-11);
}

ContactLaw rough_law(double stiffness, double damping, double friction) {
  ContactMaterial m;
  m.stiffness = 2 * stiffness, m.damping = 2 * damping;
  m.static_friction = m.kinetic_friction = friction;
  return combine(m, m);
}
BodyDescription block(const std::string& name, double mass, const Vector3d& size) {
  const double k = mass / 12;
  return free_body(
      name, mass,
      Symmetric3d::diagonal(k * (size[1] * size[1] + size[2] * size[2]), k * (size[0] * size[0] + size[2] * size[2]),
                            k * (size[0] * size[0] + size[1] * size[1])));
}

// A box on an incline: it holds below the friction angle, without creep, for a long time, and slides beyond it.
TEST(ContactPhase, BoxOnAnInclineSticksOrSlides) {
  constexpr double kFriction = 0.4, kWeight = 9.81;
  const Vector3d size{0.2, 0.2, 0.1};
  for (const double ratio : {0.9, 1.2}) {  // of tangent and friction
    Scene s({block("block", 2, size)});
    s.add(primitive(Shape::box, size)), s.add_floor();
    s.pair(0, 1, rough_law(2e4, 200, kFriction));
    const double angle = std::atan(ratio * kFriction);
    s.gravity = kWeight * Vector3d{std::sin(angle), 0, -std::cos(angle)};
    s.place(0, {0, 0, 0.05});
    s.tolerance = 1e-10;
    const double end = ratio < 1 ? 100 : 2;
    const PhaseOutcome outcome = s.run(end);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const Twistd V = twist_of(s, outcome.end_state, 0);
    if (ratio < 1) {
      EXPECT_LT(norm(V.linear), 1e-9);   // measured 2e-12
      EXPECT_LT(norm(V.angular), 1e-9);  // measured 1e-10
      EXPECT_LT(place_of(s, outcome.end_state, 0)[0], 2e-4);
    } else {
      const double slope = kWeight * (std::sin(angle) - kFriction * std::cos(angle));
      EXPECT_NEAR(V.linear[0], slope * end, 1e-3 * slope * end);  // measured 2e-4, until it slips
    }
  }
}

// Newton's cradle with gaps: the impacts follow each other, and the last ball takes the whole momentum.
TEST(ContactPhase, CradlePassesTheMomentumOn) {
  Scene s({ball("a"), ball("b"), ball("c"), ball("d")});
  for (int i = 0; i < 4; ++i) s.add(primitive(Shape::sphere, {kRadius, 0, 0}));
  for (int i = 0; i < 3; ++i) s.pair(i, i + 1, linear_law(1e5));
  const double gap = 0.02, v = 0.5;
  for (int i = 0; i < 4; ++i) s.place(i, {i * (2 * kRadius + gap), 0, 0}, moving({i == 0 ? v : 0, 0, 0}));
  const PhaseOutcome outcome = s.run(1);
  ASSERT_TRUE(outcome.finished) << outcome.failure;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(twist_of(s, outcome.end_state, i).linear[0], 0, 1e-10) << i;  // measured 2e-11
    EXPECT_EQ(s.contacts->history(i).touches, 1);
  }
  EXPECT_NEAR(twist_of(s, outcome.end_state, 3).linear[0], v, 1e-10);
}

// A ball that rolls keeps its speed; one that slides at first rolls with 5/7 of it afterwards.
TEST(ContactPhase, BallRollsWithoutLossAfterSliding) {
  for (const bool rolls : {true, false}) {
    Scene s({ball("ball")});
    s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add_floor();
    s.pair(0, 1, rough_law(2e4, 100, 0.2));
    s.gravity = {0, 0, -9.81};
    // Friction acts in the middle of the overlap.
    const double v = 0.7, sag = kMass * 9.81 / 2e4, lever = kRadius - 0.5 * sag;
    s.place(0, {0, 0, kRadius - sag}, moving({v, 0, 0}, {0, rolls ? v / lever : 0, 0}));
    s.tolerance = 1e-11;
    const PhaseOutcome outcome = s.run(10);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const Twistd V = twist_of(s, outcome.end_state, 0);
    const double ratio = lever * lever / (0.4 * kRadius * kRadius);  // of both inertias
    const double expected = rolls ? v : v * ratio / (1 + ratio);
    EXPECT_NEAR(V.linear[0], expected, 1e-8) << rolls;
    EXPECT_NEAR(V.angular[1] * lever, V.linear[0], 1e-8);
  }
}

// A block between two fingers, each pressed with 10 N: it holds 90 % of the friction of both and slips at 110 %.
TEST(ContactPhase, BlockBetweenTwoFingersSlipsBeyondItsFriction) {
  constexpr double kPress = 10, kFriction = 0.5;
  for (const double share : {0.9, 1.1}) {
    const Symmetric3d heavy = Symmetric3d::diagonal(1e9, 1e9, 1e9);  // so that the fingers do not roll
    Scene s({free_body("left", 1, heavy), block("block", 2, {0.1, 0.1, 0.1}), free_body("right", 1, heavy)});
    s.add(primitive(Shape::sphere, {kRadius, 0, 0})), s.add(primitive(Shape::box, {0.1, 0.1, 0.1}));
    s.add(primitive(Shape::sphere, {kRadius, 0, 0}));
    s.pair(0, 1, rough_law(1e4, 200, kFriction)), s.pair(2, 1, rough_law(1e4, 200, kFriction));
    s.place(0, {-0.15, 0, 0}), s.place(2, {0.15, 0, 0});
    // The fingers are pulled back with the same force as the block, so that only friction holds it.
    const double pull = share * 2 * kFriction * kPress;
    const auto push = [&](int body, const Vector3d& force, double start) {
      ExternalLoad load;
      load.body = body, load.amplitude.linear = force, load.profile.start = start;
      s.loads.push_back(load);
    };
    push(0, {kPress, 0, 0}, 0), push(2, {-kPress, 0, 0}, 0);
    push(1, {0, 0, pull}, 1), push(0, {0, 0, -0.5 * pull}, 1), push(2, {0, 0, -0.5 * pull}, 1);
    s.tolerance = 1e-10;
    const PhaseOutcome outcome = s.run(1.25);
    ASSERT_TRUE(outcome.finished) << outcome.failure;
    const double slip = twist_of(s, outcome.end_state, 1).linear[2] - twist_of(s, outcome.end_state, 0).linear[2];
    if (share < 1)
      EXPECT_LT(std::abs(slip), 1e-9);
    else
      EXPECT_NEAR(slip, 0.25 * (pull - 2 * kFriction * kPress) * (1.0 / 2 + 1.0 / 2), 1e-2)
          << share;  // it starts elastically
  }
}

}  // namespace contact_phase_test
}  // namespace grapnel::testing
