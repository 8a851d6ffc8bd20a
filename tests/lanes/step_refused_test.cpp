/// Cases that lanes hand back before a rejected step, continued by single runs: both parts together equal the phase
/// integrated by a single run.

#include <gtest/gtest.h>

#include <cmath>

#include "lanes/lane_phases.hpp"

namespace grapnel::testing {
namespace step_refused_test {

// Latest end of a step of each case [s]; some cases end earlier, and one may not begin.
double last_time(std::uint64_t id) { return id == 4 ? 0.5 : 1.2 + 0.21 * static_cast<double>(id); }

Outcomes run_with_gate(const LaneStructure& structure, const std::vector<Phase>& phases, const std::vector<int>& order,
                       InstructionSet set) {
  CaseDynamics unused;
  return run(
      structure, phases, order, set, unused,
      [&](const LaneView& view) {
        EXPECT_LE(view.time, std::max(1.0, last_time(view.id))) << "a step that does not count";
      },
      [&](const LaneView& view) { return view.time <= last_time(view.id); });
}

struct Difference {
  double state = 0, work = 0, commands = 0;
  long continued = 0;
};

// Remainder of every case by a single run, against a complete single run.
Difference continue_alone(const std::vector<Phase>& phases, const IntegrationSetup& integration, InstructionSet set) {
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, integration);
  Difference d;
  for (const auto& [id, o] : run_with_gate(structure, phases, all_of(phases), set)) {
    const Phase& p = phases[id];
    PhaseDynamics whole(p.model, p.own_setup()), rest(p.model, p.own_setup());
    const PhaseOutcome expected = simulate_phase(whole, {p.start, p.begin, p.end}, integration);
    if (o.finished()) {
      EXPECT_GE(last_time(id), p.end);
      continue;
    }
    ++d.continued;
    EXPECT_EQ(o.status, LaneStatus::step_refused);
    EXPECT_NE(explanation(o).find("a single run must continue the case"), std::string::npos);
    EXPECT_LE(o.time, std::max(last_time(id), p.begin));
    EXPECT_GT(o.next_step, 0);
    if (id == 4) {
      EXPECT_EQ(o.time, p.begin);
      EXPECT_EQ(o.steps, 0);
      continue;
    }
    EXPECT_GT(o.time, p.begin);
    if (rest.setup().clock)
      end_control(*lane_motion(structure, p.model, p.setup, p.begin, p.end), o, *rest.setup().clock);
    const PhaseResumption from{p.begin, o.integrals, o.next_step};
    const PhaseOutcome alone = simulate_phase(rest, {{o.q, o.v}, o.time, p.end}, integration, {.resumed = from});
    EXPECT_TRUE(alone.finished) << alone.failure;
    // The remainder begins with the step that was refused. The count depends on the compiler: 236 steps became 221.
    if (!p.setup.clock) {
      EXPECT_NEAR(static_cast<double>(alone.steps + o.steps), static_cast<double>(expected.steps),
                  0.3 * static_cast<double>(expected.steps) + 5);
    }
    d.state = std::max(d.state, difference(alone.end_state, expected.end_state));
    d.work = std::max(d.work, difference(alone.integrals, expected.integrals));
    if (rest.setup().clock) d.commands = std::max(d.commands, difference(*rest.setup().clock, *whole.setup().clock));
  }
  return d;
}

void expect_the_same_motion(const char* what, const std::vector<Phase>& phases, double bound = 1e-9) {
  for (InstructionSet set : supported_instruction_sets()) {
    const Difference d = continue_alone(phases, tight(1e-13), set);
    std::printf("%-20s %-8s state %.1e work %.1e commands %.1e\n", what, std::string(name(set)).c_str(), d.state,
                d.work, d.commands);
    EXPECT_LT(d.state, bound) << what;
    EXPECT_LT(d.work, 10 * bound) << what;
    EXPECT_LT(d.commands, 1e-9) << what;
    EXPECT_GT(d.continued, 5);
  }
}

std::vector<Phase> phases_of(int index, JointControl control, std::optional<ControlTiming> sampled = {},
                             bool outside = false) {
  Kind kind;
  kind.control = control;
  kind.sampled = sampled;
  kind.attitude = outside;
  if (control == JointControl::pd) kind.friction = true, kind.noise = !sampled, kind.effort = 5;
  std::vector<Phase> phases = random_phases(index, 11, kind);
  for (Phase& p : phases) {
    if (outside) p.setup.gravity = {0.3, -0.1, 0.2};
  }
  return phases;
}

TEST(LaneStepRefused, RemainderIsIntegratedBySingleRuns) {
  // Measured 7e-14 for free joints; 3e-10 (g++) and 1.6e-9 (clang) with clipped efforts, as for phases completed in
  // lanes.
  expect_the_same_motion("free", phases_of(160, JointControl::free));
  expect_the_same_motion("pd", phases_of(161, JointControl::pd), 1e-8);
  expect_the_same_motion("prescribed", phases_of(162, JointControl::prescribed));
  expect_the_same_motion("acted on", phases_of(163, JointControl::pd, {}, true));
}

TEST(LaneStepRefused, SampledControlContinues) {
  expect_the_same_motion("sampled", phases_of(164, JointControl::pd, ControlTiming{0.07, 0}, true));
  expect_the_same_motion("sampled, delayed", phases_of(165, JointControl::pd, ControlTiming{0.07, 0.1}, true));
}

// Identical bits for any width.
TEST(LaneStepRefused, BitsDependOnTheCaseAlone) {
  for (const bool outside : {false, true}) {
    const std::vector<Phase> phases = phases_of(166, JointControl::pd, ControlTiming{0.07, 0.1}, outside);
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
    const Outcomes reference = run_with_gate(structure, phases, all_of(phases), InstructionSet::one_lane);
    for (InstructionSet set : supported_instruction_sets()) {
      SCOPED_TRACE(std::string(name(set)));
      std::vector<int> order = all_of(phases);
      const Outcomes forwards = run_with_gate(structure, phases, order, set);
      std::reverse(order.begin(), order.end());
      const Outcomes backwards = run_with_gate(structure, phases, order, set);
      for (const auto& [id, o] : forwards) {
        expect_same_bits(o, backwards.at(id));
        EXPECT_EQ(o.commands, backwards.at(id).commands);
        EXPECT_EQ(o.next_step, backwards.at(id).next_step);
        if (set == InstructionSet::sse2) continue;
        expect_same_bits(o, reference.at(id));
        EXPECT_EQ(o.commands, reference.at(id).commands);
        EXPECT_EQ(o.next_step, reference.at(id).next_step);
      }
    }
  }
}

TEST(LaneStepRefused, IntegralsOfAnotherPhaseAreRefused) {
  const Phase p = phases_of(167, JointControl::pd, {}, true)[0];
  PhaseDynamics dynamics(p.model, p.setup);
  EXPECT_THROW(simulate_phase(dynamics, {p.start, 1, 2}, tight(), {.resumed = PhaseResumption{1, {}, 0.1}}),
               std::invalid_argument);
}

}  // namespace step_refused_test
}  // namespace grapnel::testing
