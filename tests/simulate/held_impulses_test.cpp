/// Work and momentum of ideal constraints (fixed base, held base, prescribed joints, wheels at their maximum rates)
/// while joints hit their stops or come to rest.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "grapnel/simulate/controller.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "simulate/phase_case.hpp"

namespace grapnel::testing {
namespace held_impulses_test {

enum class Base { floating, held, fixed };
struct Holding {
  const char* name;
  Base base;
  bool drives;  // every second joint has prescribed motion
  bool wheels;  // the base has wheels, one at its maximum rate
};
void PrintTo(const Holding& value, std::ostream* out) { *out << value.name; }

constexpr double kLargestRate = 30;

// Adds stops and sticking friction to the joints of a random robot, and wheels to the base if required.
Model with_stops(const Model& model, const State& state, const Holding& p, Random& random) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    if (has_one_axis(d.joint.type)) {
      d.joint.friction.model = JointFriction::Model::sticking;
      d.joint.friction.coulomb = random.uniform(0.1, 0.4);
      if (d.joint.type == JointType::continuous) d.joint.type = JointType::revolute;
      d.joint.limits.lower = state.q[b.q] - random.uniform(0.05, 0.4);
      d.joint.limits.upper = state.q[b.q] + random.uniform(0.05, 0.4);
      d.joint.limits.stop = JointStop{random.uniform(0.2, 0.9), 1e-3};
      if (d.joint.rotor_inertia > 0) d.joint.rotor_axis = random.direction();
    }
    builder.add(d);
  }
  for (int k = 0; p.wheels && k < 3; ++k) {
    BodyDescription rotor;
    rotor.name = rotor.joint.name = "wheel" + std::to_string(k);
    rotor.parent = "b0";
    rotor.joint.type = JointType::continuous;
    rotor.joint.axis = {k == 0 ? 1.0 : 0, k == 1 ? 1.0 : 0, k == 2 ? 1.0 : 0};
    rotor.mass = 0.1, rotor.inertia = Symmetric3d::diagonal(0.01, 0.01, 0.01);
    builder.add(rotor);
  }
  return builder.build();
}

// Accelerates the wheels: a wheel at its maximum rate is held there.
struct ConstantTorque : Controller {
  void update(const ControlInput&, ControlCommand& command) override { command.base_torque = {-0.5, 0.1, 0.2}; }
};

PhaseSetup setup_of(const Model& model, State& state, const Holding& p, Random& random) {
  PhaseSetup setup;
  setup.drives.resize(model.joints().size());
  for (std::size_t j = 0; p.drives && j < setup.drives.size(); j += 2) {
    const Body& body = model.bodies()[model.joints()[j]];
    if (body.description.name.starts_with("wheel")) continue;
    const double rate = random.uniform(-0.6, 0.6), start = state.q[body.q];
    setup.drives[j].control = JointControl::prescribed;
    setup.drives[j].trajectory = {0, JointPath{JointProfile::quintic, 2, start, start + 2 * rate, rate, rate}};
    state.v[body.v] = rate;
  }
  const int base = model.body_index("b0");
  setup.held_root = p.base == Base::held ? base : -1;
  for (int k = 0; p.wheels && k < 3; ++k) {
    const int body = model.body_index("wheel" + std::to_string(k));
    const auto& joints = model.joints();
    const auto joint = std::find(joints.begin(), joints.end(), body) - joints.begin();
    const Vector3d& axis = model.bodies()[body].description.joint.axis;
    setup.wheels.push_back({static_cast<int>(joint), model.bodies()[body].v, axis, 10, kLargestRate});
    setup.wheels.back().inertia = 0.01;
    state.v[model.bodies()[body].v] = k == 0 ? kLargestRate : 5;
  }
  if (p.wheels) setup.controller = std::make_shared<ConstantTorque>(), setup.commanded_root = base;
  return setup;
}

// The base's tree: momentum about its centre of mass, and kinetic energy relative to that.
struct Inner {
  Momentumd h;
  double energy;
};
Inner inner(const Model& model, const State& state) {
  const Totals all = totals(model, state);
  const Vector3d& p = all.momentum.linear;
  return {{all.momentum.angular - cross(all.com, p), p}, all.energy - 0.5 * dot(p, p) / model.mass()};
}

class HeldImpulses : public ::testing::TestWithParam<Holding> {};

TEST_P(HeldImpulses, AreInTheBalances) {
  const Holding& p = GetParam();
  long impacts = 0;
  double off = 0, largest_work = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.min_bodies = 4, options.max_bodies = 7, options.targets = 0;
    options.free_root = p.base != Base::fixed;
    const Model plain = random_model(options, random);
    const Model model = with_stops(plain, random_state(plain, random, 0), p, random);
    State state = random_state(model, random, 1.0);
    for (int body : model.joints()) {
      const Body& b = model.bodies()[body];
      const JointLimits& limits = b.description.joint.limits;
      if (limits.stop) state.q[b.q] = 0.5 * (limits.lower + limits.upper);
    }
    if (p.base == Base::held) set_root_twist(model, model.body_index("b0"), Twistd::zero(), state);
    PhaseSetup setup = setup_of(model, state, p, random);
    PhaseDynamics dynamics(model, setup);
    const Inner before = inner(model, state);
    double scale = before.energy, missing = 0;
    const PhaseOutcome o = simulate_phase(
        dynamics, {state, 0, 1.5, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
          const Inner now = inner(model, s.state);
          const TreeIntegrals outside = s.integrals.trees.empty() ? TreeIntegrals{} : s.integrals.trees[0];
          const double work = s.integrals.motor_work + s.integrals.friction_work + outside.work;
          scale = std::max(scale, now.energy);
          missing = std::max(missing, std::abs(now.energy - before.energy - work));
          largest_work = std::max(largest_work, std::abs(outside.work) + std::abs(s.integrals.motor_work));
          const Momentumd entered = now.h - before.h - outside.impulse;
          off = std::max({off, norm(entered.linear) / std::max(1.0, norm(now.h.linear)),
                          norm(entered.angular) / std::max(1.0, norm(now.h.angular))});
        }});
    ASSERT_TRUE(o.finished) << o.failure;
    impacts += dynamics.joint_modes().stop_impact_count();
    EXPECT_LT(missing / scale, 1e-10);
    off = std::max(off, missing / scale);
  }
  std::printf("[ measured ] %s: %.2g off over %ld impacts; work %.3g J\n", p.name, off, impacts, largest_work);
  EXPECT_LT(off, 1e-10);
  EXPECT_GT(impacts, 10);  // measured 17 to 153
  if (p.base != Base::floating || p.drives || p.wheels) {
    EXPECT_GT(largest_work, 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(All, HeldImpulses,
                         ::testing::Values(Holding{"floating", Base::floating, false, false},
                                           Holding{"floating_driven", Base::floating, true, false},
                                           Holding{"held", Base::held, false, false},
                                           Holding{"held_driven", Base::held, true, false},
                                           Holding{"fixed", Base::fixed, false, false},
                                           Holding{"fixed_driven", Base::fixed, true, false},
                                           Holding{"wheels", Base::floating, false, true},
                                           Holding{"wheels_driven", Base::floating, true, true}),
                         [](const auto& test) { return test.param.name; });

}  // namespace held_impulses_test
}  // namespace grapnel::testing
