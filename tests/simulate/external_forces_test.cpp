/// Gravity, a held root and a fixed base: impulse, work, and closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace external_forces_test {

double size(const Momentumd& h) { return norm(h.angular) + norm(h.linear); }

enum class Root { floating, held, fixed };
struct Surroundings {
  const char* name;
  Root root;
  Vector3d gravity;
};
void PrintTo(const Surroundings& value, std::ostream* out) { *out << value.name; }
class External : public ::testing::TestWithParam<Surroundings> {};
INSTANTIATE_TEST_SUITE_P(All, External,
                         ::testing::Values(Surroundings{"gravity", Root::floating, {1.1, -2.3, -9.81}},
                                           Surroundings{"held", Root::held, {0, 0, 0}},
                                           Surroundings{"held_under_gravity", Root::held, {0.3, 0.2, -9.81}},
                                           Surroundings{"fixed", Root::fixed, {0, 0, 0}},
                                           Surroundings{"fixed_under_gravity", Root::fixed, {0.3, 0.2, -9.81}}),
                         [](const auto& test) { return test.param.name; });

// The change of momentum equals the external impulse; the change of energy equals the work.
TEST_P(External, ImpulseAndWorkBalance) {
  const Surroundings& p = GetParam();
  Worst momentum(std::string("momentum less external impulse, over the largest momentum, ") + p.name);
  Worst energy(std::string("energy less work, ") + p.name);
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.max_bodies = 10;
    options.free_root = p.root != Root::fixed;
    options.targets = i % 2;
    const Model model = with_friction(random_model(options, random), 0.2, 0);
    if (model.joints().empty()) continue;
    State start = random_state(model, random, 0.5);
    const int base = model.body_index("b0");
    if (p.root == Root::held) set_root_twist(model, base, Twistd::zero(), start);
    PhaseSetup setup;
    setup.gravity = p.gravity;
    setup.held_root = p.root == Root::held ? base : -1;
    setup.drives = random_drives(model, start, i % 3 == 0 ? JointControl::prescribed : JointControl::pd, 2, random);
    PhaseDynamics dynamics(model, setup);
    const Totals before = totals(model, start);
    const Posed X_WB = root_pose(model, start, base);
    double largest = size(before.momentum), off = 0, most = before.energy, lost = 0, max_impulse = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {start, 0, 2, 0.2}, {}, {.observe = [&](const PhaseSample& s) {
                         const Totals now = totals(model, s.state);
                         largest = std::max(largest, size(now.momentum));
                         max_impulse = std::max(max_impulse, size(s.integrals.external_impulse));
                         off = std::max(off, size(now.momentum - before.momentum - s.integrals.external_impulse));
                         most = std::max(most, now.energy);
                         lost = std::max(lost, std::abs(now.energy - before.energy - s.integrals.motor_work -
                                                        s.integrals.friction_work - s.integrals.external_work));
                         if (p.root == Root::held) {
                           const Posed X = root_pose(model, s.state, base);
                           EXPECT_LT(norm(X.p - X_WB.p) + rotation_angle(transpose(X.R) * X_WB.R), 1e-15);
                         }
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_GT(max_impulse, 0.01);
    // The impulse is integrated without error control: 2e-12 here, 4e-10 over six other seeds.
    EXPECT_LT(momentum.note(off / largest, i), 5e-9);
    EXPECT_LT(energy.note(lost / most, i), 1e-9);
  }
}

TEST(Gravity, CentreOfMassFallsOnAParabola) {
  Random random(3);
  const Model model = random_model({}, random);
  const State start = random_state(model, random);
  PhaseSetup setup;
  setup.gravity = {0, 1, -9.81};
  PhaseDynamics dynamics(model, setup);
  const Totals before = totals(model, start);
  const Vector3d v = (1 / model.mass()) * before.momentum.linear;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 3, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                       const Totals now = totals(model, s.state);
                       const Vector3d expected = before.com + s.time * v + 0.5 * s.time * s.time * setup.gravity;
                       EXPECT_LT(norm(now.com - expected), 1e-10);  // measured 9.2e-13
                       const double work = model.mass() * dot(setup.gravity, now.com - before.com);
                       EXPECT_NEAR(s.integrals.external_work, work, 1e-10 * (1 + std::abs(work)));
                       const Vector3d impulse = model.mass() * s.time * setup.gravity;
                       EXPECT_LT(norm(s.integrals.external_impulse.linear - impulse), 1e-10 * (1 + norm(impulse)));
                     }});
  EXPECT_TRUE(o.finished);
}

// A pendulum on the ground: period by the arithmetic-geometric mean, ground force in closed form at the lowest point.
TEST(FixedRoot, PendulumPeriodAndEnergy) {
  BodyDescription ground, bob;
  ground.name = ground.joint.name = "ground";
  ground.joint.type = JointType::fixed;
  ground.mass = 7;
  ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  bob.name = bob.joint.name = "bob";
  bob.parent = "ground";
  bob.joint.type = JointType::continuous;
  bob.joint.axis = {0, 1, 0};
  bob.mass = 2;
  bob.com = {0, 0, -0.8};
  bob.inertia = Symmetric3d::diagonal(0.1, 0.1, 0.05);
  const Model model = ModelBuilder().add(ground).add(bob).build();
  State start = zero_state(model);
  start.q[0] = 1.9;
  PhaseSetup setup;
  setup.gravity = {0, 0, -9.81};
  PhaseDynamics dynamics(model, setup);
  const double I = 0.1 + 2 * 0.8 * 0.8, w0 = std::sqrt(2 * 9.81 * 0.8 / I);
  double a = 1, g = std::cos(1.9 / 2);
  while (std::abs(a - g) > 1e-15) {
    const double mean = 0.5 * (a + g);
    g = std::sqrt(a * g), a = mean;
  }
  const double period = 2 * M_PI / (w0 * a);
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, period});
  ASSERT_TRUE(o.finished);
  EXPECT_NEAR(o.end_state.q[0], 1.9, 1e-11);
  EXPECT_NEAR(o.end_state.v[0], 0, 1e-11);
  EXPECT_NEAR(o.integrals.external_work, 0, 1e-10);
  // Over a period the linear impulses of ground and gravity cancel.
  EXPECT_LT(norm(o.integrals.external_impulse.linear), 1e-10);
  const PhaseOutcome half = simulate_phase(dynamics, {start, 0, period / 4});
  EXPECT_NEAR(half.end_state.q[0], 0, 1e-10);
  EXPECT_NEAR(half.end_state.v[0], -w0 * std::sqrt(2 * (1 - std::cos(1.9))), 1e-10);
}

}  // namespace external_forces_test
}  // namespace grapnel::testing
