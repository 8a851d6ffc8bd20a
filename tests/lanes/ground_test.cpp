/// Held roots and fixed roots in lanes against scalar integration.

#include <gtest/gtest.h>

#include <cmath>

#include "lanes/lane_phases.hpp"

namespace grapnel::testing {
namespace ground_test {

// The first robot's base is held at its pose. With `acted_on`, gravity and a force on every body's origin act.
std::vector<Phase> held_phases(int index, int count, const Kind& kind, bool acted_on = false) {
  std::vector<Phase> phases = random_phases(index, count, kind);
  Random random(700 + index);
  for (Phase& p : phases) {
    if (!kind.fixed_root) {
      p.setup.held_root = p.model.body_index("b0");
      set_root_twist(p.model, p.setup.held_root, Twistd::zero(), p.start);
    }
    if (!acted_on) continue;
    p.setup.gravity = random.vector(2);
    ExternalLoad push;
    push.body = p.model.body_index("b0");
    push.amplitude = {random.vector(1), random.vector(3)};
    p.setup.loads.push_back(push);
    push.body = p.model.body_index("t0");
    p.setup.loads.push_back(push);
  }
  return phases;
}

// The ground reaction must not be small, so that agreement is significant.
void expect_ground_works(const std::vector<Phase>& phases) {
  const Phase& p = phases[0];
  PhaseDynamics dynamics(p.model, p.own_setup());
  const PhaseOutcome o = simulate_phase(dynamics, {p.start, p.begin, p.end}, tight());
  double most = 0;
  for (const TreeIntegrals& tree : o.integrals.trees)
    most = std::max(most, norm(tree.impulse.linear) + norm(tree.impulse.angular));
  EXPECT_GT(most, 0.1);
}

void expect_held_alike(const char* what, int index, const Kind& kind, bool acted_on = false) {
  const std::vector<Phase> phases = held_phases(index, 9, kind, acted_on);
  expect_ground_works(phases);
  expect_alike(what, phases, 1e-9, tight(1e-13));  // measured 3e-11
}

Kind driven_by(JointControl control) {
  Kind kind;
  kind.control = control;
  if (control == JointControl::pd) kind.friction = kind.noise = true, kind.effort = 8;
  if (control == JointControl::computed_torque) kind.friction = true;
  return kind;
}

constexpr JointControl kControls[] = {JointControl::free, JointControl::pd, JointControl::prescribed,
                                      JointControl::computed_torque};

TEST(LaneGround, HeldRootsAgree) {
  int index = 120;
  for (const JointControl control : kControls) expect_held_alike("held", index++, driven_by(control));
}

TEST(LaneGround, FixedRootsAgree) {
  int index = 130;
  for (const JointControl control : kControls) {
    Kind kind = driven_by(control);
    kind.fixed_root = true;
    expect_held_alike("fixed", index++, kind);
  }
}

TEST(LaneGround, HeldAndFixedRootsAgreeUnderGravityAndLoads) {
  Kind kind = driven_by(JointControl::pd);
  expect_held_alike("held, acted on", 140, kind, true);
  kind.fixed_root = true;
  expect_held_alike("fixed, acted on", 141, kind, true);
}

TEST(LaneGround, SampledControlAgrees) {
  Kind kind = driven_by(JointControl::pd);
  kind.effort = 0.5;
  kind.sampled = ControlTiming{0.02, 0.026};
  expect_held_alike("held, sampled", 142, kind);
}

// A held root does not move at all.
TEST(LaneGround, HeldRootsStayWhereTheyAre) {
  const std::vector<Phase> phases = held_phases(143, 9, driven_by(JointControl::pd), true);
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
  for (InstructionSet set : supported_instruction_sets()) {
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
      const Phase& p = phases[id];
      const int base = p.setup.held_root;
      const Posed X = root_pose(p.model, {o.q, o.v}, base), X0 = root_pose(p.model, p.start, base);
      EXPECT_LT(norm(X.p - X0.p) + rotation_angle(transpose(X.R) * X0.R), 1e-15);
      for (int k = 0; k < 6; ++k)
        EXPECT_EQ(o.v[static_cast<std::size_t>(p.model.bodies()[static_cast<std::size_t>(base)].v + k)], 0);
    }
  }
}

TEST(LaneGround, BitsDependOnTheCaseAlone) {
  expect_bits_of_the_case_alone(held_phases(150, 13, driven_by(JointControl::pd), true));
  Kind fixed = driven_by(JointControl::computed_torque);
  fixed.fixed_root = true;
  expect_bits_of_the_case_alone(held_phases(151, 13, fixed));
}

// Lanes require a floating base for closed loops.
TEST(LaneGround, LoopsOnAHeldBaseAreNotSupported) {
  Phase p = held_phases(152, 1, {})[0];
  ASSERT_GE(p.model.bodies().size(), 3U);
  PhaseSetup setup = p.setup;
  setup.closures.push_back(
      {"loop", p.model.body_index("b1"), Posed::identity(), p.model.body_index("b2"), Posed::identity()});
  EXPECT_EQ(lane_obstacle(p.model, setup, tight()), "closed loops on a fixed or held base");
  setup.held_root = -1;
  EXPECT_EQ(lane_obstacle(p.model, setup, tight()), "");
}

}  // namespace ground_test
}  // namespace grapnel::testing
