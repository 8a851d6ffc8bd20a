/// Loads on bodies: shapes in time, energy balance, closed forms.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace external_load_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Shape = LoadProfile::Shape;

ExternalLoad load_of(Shape shape, double start, double end) {
  ExternalLoad load;
  load.amplitude = {{1, 2, 3}, {4, 5, 6}};
  load.profile.shape = shape;
  load.profile.start = start, load.profile.end = end;
  return load;
}
double along_x(const ExternalLoad& load, double t) { return wrench_at(load, t).linear[0]; }

TEST(LoadProfile, Shapes) {
  const ExternalLoad constant = load_of(Shape::constant, 1, 3);
  EXPECT_EQ(along_x(constant, 0.999), 0);
  EXPECT_EQ(along_x(constant, 1), 4);
  EXPECT_EQ(along_x(constant, 2.999), 4);
  EXPECT_EQ(along_x(constant, 3), 0);
  EXPECT_EQ(wrench_at(constant, 2).angular[2], 3);
  EXPECT_EQ(along_x(load_of(Shape::constant, -INFINITY, INFINITY), -1e9), 4);

  const ExternalLoad half = load_of(Shape::half_sine, 1, 3);
  EXPECT_EQ(along_x(half, 1), 0);
  EXPECT_NEAR(along_x(half, 2), 4, 1e-15);
  EXPECT_NEAR(along_x(half, 2.5), 4 * std::sqrt(0.5), 1e-15);
  EXPECT_EQ(along_x(half, 3.1), 0);

  ExternalLoad sine = load_of(Shape::sine, 1, 3);
  sine.profile.frequency = 0.5, sine.profile.phase = 0.3;
  EXPECT_NEAR(along_x(sine, 1), 4 * std::sin(0.3), 1e-15);
  EXPECT_NEAR(along_x(sine, 1.7), 4 * std::sin(M_PI * 0.7 + 0.3), 1e-15);
  EXPECT_EQ(along_x(sine, 3), 0);
}

ExternalLoad table() {
  ExternalLoad load = load_of(Shape::table, -INFINITY, INFINITY);
  load.profile.times = {0, 1, 3};
  load.profile.values = {{{0, 0, 0}, {2, 0, 0}}, {{0, 0, 1}, {4, 0, 0}}, {{0, 0, 0}, {0, 0, 0}}};
  return load;
}

TEST(LoadProfile, TablesAreLinearBetweenSamples) {
  ExternalLoad load = table();
  EXPECT_EQ(along_x(load, -0.1), 0);
  EXPECT_EQ(along_x(load, 0), 2);
  EXPECT_EQ(along_x(load, 0.25), 2.5);
  EXPECT_EQ(along_x(load, 2), 2);
  EXPECT_EQ(wrench_at(load, 2).angular[2], 0.5);
  load.profile.values[2].linear[0] = 7;
  EXPECT_EQ(along_x(load, 3), 7);
  EXPECT_EQ(along_x(load, 3.1), 0);
}

TEST(LoadProfile, OneSidedLimitsAtBreak) {
  const ExternalLoad constant = load_of(Shape::constant, 1, 3);
  EXPECT_EQ(wrench_at(constant, 1, 0.5).linear[0], 0);
  EXPECT_EQ(wrench_at(constant, 3, 2).linear[0], 4);
  EXPECT_EQ(wrench_at(table(), 0, -1).linear[0], 0);
  EXPECT_EQ(wrench_at(table(), 0, 0.5).linear[0], 2);
  EXPECT_THAT(break_times(constant), ElementsAre(1, 3));
  EXPECT_THAT(break_times(load_of(Shape::constant, 1, INFINITY)), ElementsAre(1));
  EXPECT_THAT(break_times(table()), ElementsAre(0, 1, 3));
  ExternalLoad cut = table();
  cut.profile.start = 0.5, cut.profile.end = 2;
  EXPECT_THAT(break_times(cut), ElementsAre(0.5, 1, 2));
  EXPECT_EQ(along_x(cut, 0.4), 0);
  EXPECT_EQ(along_x(cut, 2.5), 0);
}

TEST(ExternalLoad, NamesErrors) {
  const Model model = one_body(Symmetric3d::diagonal(1, 1, 1));
  const auto message = [&](const ExternalLoad& load) -> std::string {
    PhaseSetup setup;
    setup.loads = {load};
    try {
      PhaseDynamics(model, setup);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(load_of(Shape::constant, 0, INFINITY)), "accepted");
  EXPECT_EQ(message(table()), "accepted");
  ExternalLoad load = load_of(Shape::constant, 0, 1);
  load.body = 1;
  EXPECT_THAT(message(load), HasSubstr("not in the model"));
  load = load_of(Shape::constant, 1, 1);
  EXPECT_THAT(message(load), HasSubstr("end after it starts"));
  EXPECT_THAT(message(load_of(Shape::half_sine, 0, INFINITY)), HasSubstr("finite start and end"));
  load = load_of(Shape::constant, 0, 1);
  load.amplitude.linear[1] = NAN;
  EXPECT_THAT(message(load), HasSubstr("not finite"));
  load = table();
  load.profile.times = {0, 1, 1};
  EXPECT_THAT(message(load), HasSubstr("times must increase"));
  load.profile.times = {0, 1};
  EXPECT_THAT(message(load), HasSubstr("differ in number"));
  load.profile.times = {0};
  EXPECT_THAT(message(load), HasSubstr("at least two samples"));
}

ExternalLoad random_load(const Model& model, int i, Random& random) {
  ExternalLoad load;
  load.body = random.integer(0, static_cast<int>(model.bodies().size()) - 1);
  load.p_BP = random.vector(0.8);
  load.frame = random.chance(0.5) ? LoadFrame::body : LoadFrame::world;
  load.amplitude = {random.vector(2), random.vector(5)};
  load.profile.start = random.uniform(0.05, 0.5), load.profile.end = random.uniform(0.8, 1.5);
  load.profile.shape = static_cast<Shape>(i % 4);
  load.profile.frequency = random.uniform(0.2, 2), load.profile.phase = random.uniform(-3, 3);
  for (double t : {0.1, 0.4, 0.9, 1.3}) {
    load.profile.times.push_back(t);
    load.profile.values.push_back({random.vector(2), random.vector(5)});
  }
  return load;
}

// Momentum and energy change by impulse and work of loads and attitude control, also with joint control and friction.
TEST(ExternalLoad, ImpulseAndWorkBalance) {
  Worst momentum("momentum less impulse of loads, over the largest"), energy("energy less work of loads");
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 3, options.max_bodies = 9;
    options.targets = 1;
    options.free_root = i % 6 != 0;
    const Model model = with_friction(random_model(options, random), 0.2, 0);
    const State start = random_state(model, random, 0.4);
    PhaseSetup setup;
    setup.drives = random_drives(model, start, i % 3 == 0 ? JointControl::prescribed : JointControl::pd, 2, random);
    for (int k = 0; k < 4; ++k) setup.loads.push_back(random_load(model, k, random));
    setup.loads.push_back(random_load(model, i, random));
    setup.loads.back().body = model.body_index("t0");
    if (options.free_root && i % 2 == 0) {
      setup.attitude = {model.body_index("b0"), random.rotation(), {20, 30, 10}, {5, 6, 7}};
    }
    PhaseDynamics dynamics(model, setup);
    const PhaseBalance balance = balance_under_loads(model, dynamics, start);
    // Measured 4.3e-13 and 1.8e-13 over five seeds; 2.6e-11 and 7.3e-12 at the default tolerances, due to truncation.
    EXPECT_LT(momentum.note(balance.momentum, i), 1e-11);
    EXPECT_LT(energy.note(balance.energy, i), 1e-11);
  }
}

// A body welded to the root is merged into its link; the load still acts at its point.
TEST(ExternalLoad, WeldedBodyEqualsCarrier) {
  BodyDescription root, welded;
  root.name = root.joint.name = "root";
  root.joint.type = JointType::free;
  root.mass = 5, root.com = {0.1, 0, 0.2};
  root.inertia = Symmetric3d::diagonal(1, 1.3, 1.7);
  welded.name = welded.joint.name = "welded";
  welded.parent = "root";
  welded.X_PF = {rotation_about({0, 0.6, 0.8}, 1.1), {0.3, -0.5, 0.4}};
  welded.mass = 2, welded.com = {0, 0.3, 0};
  welded.inertia = Symmetric3d::diagonal(0.2, 0.3, 0.4);
  const Model model = ModelBuilder().add(root).add(welded).build();
  Random random(1);
  const State start = random_state(model, random, 0.5);
  for (bool in_body : {false, true}) {
    PhaseSetup on_welded;
    ExternalLoad load;
    load.body = model.body_index("welded");
    load.p_BP = {0.2, 0.7, -0.1};
    load.frame = in_body ? LoadFrame::body : LoadFrame::world;
    load.amplitude = {{0.3, -0.2, 0.1}, {1, 2, -1}};
    on_welded.loads = {load};
    PhaseSetup on_root = on_welded;
    on_root.loads[0].body = model.body_index("root");
    on_root.loads[0].p_BP = welded.X_PF * load.p_BP;
    if (in_body) on_root.loads[0].amplitude = welded.X_PF.R * load.amplitude;
    PhaseDynamics a(model, on_welded), b(model, on_root);
    const PhaseOutcome of_a = simulate_phase(a, {start, 0, 3}), of_b = simulate_phase(b, {start, 0, 3});
    EXPECT_LT(difference(of_a.end_state, of_b.end_state), 1e-11);  // measured 2.7e-14
    EXPECT_GT(difference(of_a.end_state, start), 0.5);
    EXPECT_NEAR(of_a.integrals.external_work, of_b.integrals.external_work, 1e-11);
    EXPECT_GT(std::abs(of_a.integrals.external_work), 0.1);
  }
}

TEST(ExternalLoad, HalfSineImpulse) {
  const Vector3d com{0.2, 0.1, -0.3};
  const Model model = one_body(Symmetric3d::diagonal(1, 2, 2.5), com);
  ExternalLoad load = load_of(Shape::half_sine, 0.3, 0.8);
  load.amplitude = {{0, 0, 0}, {7, -3, 2}};
  load.p_BP = com;
  PhaseSetup setup;
  setup.loads = {load};
  PhaseDynamics dynamics(model, setup);
  const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 2});
  const double share = 2 / M_PI * 0.5;
  const Totals end = totals(model, o.end_state);
  EXPECT_LT(norm(end.momentum.linear - share * Vector3d{7, -3, 2}), 1e-12);
  EXPECT_LT(norm(o.integrals.external_impulse.linear - share * Vector3d{7, -3, 2}), 1e-12);
  EXPECT_LT(norm(cross(com, o.integrals.external_impulse.linear) - o.integrals.external_impulse.angular), 1e-12);
  EXPECT_NEAR(o.integrals.external_work, share * share * 62 / (2 * 3), 1e-12);  // 62 = 7^2 + 3^2 + 2^2
  // The push is symmetric in time: the mean velocity of the centre of mass during it is half the final velocity.
  EXPECT_LT(norm(end.com - com - (share * (0.25 + 1.2) / 3) * Vector3d{7, -3, 2}), 1e-12);
}

// A body-fixed force rotates with the body; a force in W has a fixed direction.
TEST(ExternalLoad, BodyFrameRotates) {
  const Model model = one_body(Symmetric3d::diagonal(1, 1, 1.5));
  State start = zero_state(model);
  const double w = 0.7, t = 3;
  set_root_twist(model, 0, {{0, 0, w}, {0, 0, 0}}, start);
  ExternalLoad load;
  load.amplitude.linear = {6, 0, 0};
  const auto speed = [&](bool in_body) {
    PhaseSetup setup;
    setup.loads = {load};
    setup.loads[0].frame = in_body ? LoadFrame::body : LoadFrame::world;
    PhaseDynamics dynamics(model, setup);
    return root_twist(model, simulate_phase(dynamics, {start, 0, t}).end_state, 0).linear;
  };
  EXPECT_LT(norm(speed(false) - Vector3d{2 * t, 0, 0}), 1e-12);
  EXPECT_LT(norm(speed(true) - (2 / w) * Vector3d{std::sin(w * t), 1 - std::cos(w * t), 0}), 1e-12);
}

}  // namespace external_load_test
}  // namespace grapnel::testing
