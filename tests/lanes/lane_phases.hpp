#pragma once

/// @file
/// Phases of random robots, integrated in lanes and one at a time.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <memory>

#include "grapnel/lanes/lane_phase_setup.hpp"
#include "simulate/phase_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {

using namespace lanes;

/// One phase, for both integrations.
struct Phase {
  Model model;
  PhaseSetup setup;
  State start;
  double begin = 0, end = 1;
  std::function<void(PhaseSetup&)> renew =
      {};  // recreates stateful objects other than the clock; empty: there are none

  Rotationd start_attitude() const { return root_pose(model, start, 0).R; }
  /// The setup with its own clock and other stateful objects.
  PhaseSetup own_setup() const {
    PhaseSetup own = setup;
    if (own.clock) own.clock = std::make_shared<ControlClock>(*setup.clock);
    if (renew) renew(own);
    return own;
  }
};

using Outcomes = std::map<std::uint64_t, LaneOutcome>;
/// Dynamics of the cases that computed their own commands (ControlTable::by_case), in their final state.
using CaseDynamics = std::map<std::uint64_t, std::unique_ptr<PhaseDynamics>>;

/// Runs cases of one structure; `order` gives their ids.
inline Outcomes run(const LaneStructure& structure, const std::vector<Phase>& phases, const std::vector<int>& order,
                    InstructionSet set, CaseDynamics& case_dynamics, const LaneWatch& watch = {},
                    const LaneGate& gate = {}) {
  Outcomes outcomes;
  std::size_t next = 0;
  const LaneCaller caller{[&](LaneCase& c) {
                            if (next == order.size()) return false;
                            const Phase& p = phases[static_cast<std::size_t>(order[next])];
                            c.id = static_cast<std::uint64_t>(order[next++]);
                            if (structure.control.by_case)
                              case_dynamics[c.id] = std::make_unique<PhaseDynamics>(p.model, p.own_setup());
                            lane_case(structure, p.model, p.setup, p.start,
                                      lane_motion(structure, p.model, p.setup, p.begin, p.end), c);
                            return true;
                          },
                          [&](const LaneCase& c, const LaneOutcome& o) {
                            EXPECT_EQ(c.id, o.id);
                            EXPECT_TRUE(outcomes.emplace(o.id, o).second) << "case " << o.id << " came twice";
                            if (structure.control.by_case) case_dynamics.at(o.id)->end_control(o.time);
                          },
                          watch, gate,
                          [&](const LaneTurn& turn, std::span<double> command) {
                            return take_turn(structure, *case_dynamics.at(turn.id), turn, command);
                          }};
  run_lanes(structure, caller, set);
  return outcomes;
}

inline Outcomes run(const LaneStructure& structure, const std::vector<Phase>& phases, const std::vector<int>& order,
                    InstructionSet set) {
  CaseDynamics case_dynamics;
  return run(structure, phases, order, set, case_dynamics);
}

inline std::vector<int> all_of(const std::vector<Phase>& phases) {
  std::vector<int> order;
  for (std::size_t i = 0; i < phases.size(); ++i) order.push_back(static_cast<int>(i));
  return order;
}

/// The same robot with every mass, centre and inertia changed by up to 20 %.
inline Model perturbed(const Model& model, Random& random) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    const double factor = random.uniform(0.8, 1.2);
    d.mass *= factor;
    for (int k = 0; k < 3; ++k) d.com[k] *= random.uniform(0.8, 1.2);
    const double inertia = random.uniform(0.8, 1.2);
    d.inertia = Symmetric3d{inertia * d.inertia.xx, inertia * d.inertia.yy, inertia * d.inertia.zz,
                            inertia * d.inertia.xy, inertia * d.inertia.xz, inertia * d.inertia.yz};
    builder.add(d);
  }
  return builder.build();
}

struct Kind {
  JointControl control = JointControl::free;
  bool friction = false, noise = false, spherical = false;
  double effort = std::numeric_limits<double>::infinity();
  JointProfile profile = JointProfile::quintic;
  std::optional<ControlTiming> sampled = {};  // every case with a separate period, close to this one
  bool attitude = false;
  bool fixed_root = false;  // of the robot
};

/// Cases of a random robot with two free targets; trajectories end within the phase.
inline std::vector<Phase> random_phases(int index, int count, const Kind& kind) {
  Random random(index);
  RobotOptions options;
  options.min_bodies = 3, options.max_bodies = 8;
  options.spherical_joints = kind.spherical;
  options.targets = 2;
  options.free_root = !kind.fixed_root;
  Model nominal = random_model(options, random);
  if (kind.friction) {
    nominal = with_friction(nominal, 0.4, 0.3, kind.effort);
  } else if (std::isfinite(kind.effort)) {
    nominal = with_friction(nominal, 0, 0, kind.effort);
  }
  std::vector<Phase> phases;
  for (int i = 0; i < count; ++i) {
    Phase p{perturbed(nominal, random), {}, {}, 1, 3};
    p.start = random_state(p.model, random, 0.5);
    const bool prescribed = kind.control == JointControl::prescribed;
    p.setup.drives = random_drives(p.model, p.start, kind.control, 1.3, random, prescribed ? 1 : 1.1);
    for (std::size_t j = 0; j < p.setup.drives.size(); ++j) {
      JointDrive& drive = p.setup.drives[j];
      JointPath& path = std::get<JointPath>(drive.trajectory.segments[0].shape);
      path.profile = kind.profile;
      if (prescribed) path.end_rate = 0;
      drive.kp = random.uniform(20, 60);
      if (kind.noise) {
        drive.noise =
            NoiseSignal({1e-3, 2, static_cast<std::uint64_t>(1000 * index + i)}, static_cast<std::uint32_t>(j));
      }
    }
    if (kind.attitude) p.setup.attitude = AttitudeControl{0, p.start_attitude(), {40, 50, 60}, {30, 35, 40}, {2, 2, 2}};
    if (kind.sampled) {
      for (JointDrive& drive : p.setup.drives) drive.kp = random.uniform(1, 3), drive.kd = random.uniform(0.5, 1);
      const double period = kind.sampled->period * random.uniform(0.9, 1.1);
      p.setup.clock = std::make_shared<ControlClock>(
          ControlTiming{period, kind.sampled->delay / kind.sampled->period * period}, p.model.joints().size());
    }
    phases.push_back(std::move(p));
  }
  return phases;
}

inline IntegrationSetup tight(double relative = 1e-12) {
  IntegrationSetup integration;
  integration.relative_tolerance = relative;
  integration.absolute_tolerance = 0.1 * relative;
  return integration;
}

/// The integrals as one list.
inline std::vector<double> numbers_of(const PhaseIntegrals& i) {
  std::vector<double> all{i.motor_work, i.friction_work, i.external_work};
  const auto add = [&](const Momentumd& h) {
    all.insert(all.end(), h.angular.e, h.angular.e + 3);
    all.insert(all.end(), h.linear.e, h.linear.e + 3);
  };
  add(i.external_impulse);
  for (const TreeIntegrals& tree : i.trees) add(tree.impulse), all.push_back(tree.work);
  return all;
}
inline double difference(const PhaseIntegrals& a, const PhaseIntegrals& b) {
  const std::vector<double> x = numbers_of(a), y = numbers_of(b);
  EXPECT_EQ(x.size(), y.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) largest = std::max(largest, std::abs(x[i] - y[i]));
  return largest;
}

inline const char* worst_of(double value, double bound) { return value <= bound ? "" : " <-- too large"; }

/// Difference of active and delayed commands.
inline double difference(const ControlClock& a, const ControlClock& b) {
  const std::vector<ControlClock::Command> x = a.commands(), y = b.commands();
  EXPECT_EQ(x.size(), y.size());
  double largest = 0;
  for (std::size_t k = 0; k < std::min(x.size(), y.size()); ++k) {
    largest = std::max(largest, norm(x[k].base_torque - y[k].base_torque));
    for (std::size_t c = 0; c < x[k].effort.size(); ++c)
      largest = std::max(largest, std::abs(x[k].effort[c] - y[k].effort[c]));
    EXPECT_EQ(x[k].wheel_rates.size(), y[k].wheel_rates.size());
    for (std::size_t w = 0; w < std::min(x[k].wheel_rates.size(), y[k].wheel_rates.size()); ++w)
      largest = std::max(largest, std::abs(x[k].wheel_rates[w] - y[k].wheel_rates[w]));
  }
  return largest;
}

/// Difference of the thrusters' consumption, relative to their maximum impulse and time; firing counts must be equal.
inline double difference(const ThrusterBank& a, const ThrusterBank& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.use(i).firings, b.use(i).firings) << "thruster " << i;
    largest = std::max(
        {largest, std::abs(a.use(i).impulse - b.use(i).impulse), std::abs(a.use(i).on_time - b.use(i).on_time)});
  }
  EXPECT_EQ(a.dumped().begun, b.dumped().begun);
  return largest;
}

/// Largest difference of end states, and of the work done, against the scalar integration.
struct Comparison {
  double state = 0, work = 0, linear = 0, angular = 0, energy = 0, commands = 0, thrusters = 0;
  long steps = 0, scalar_steps = 0;
};
inline Comparison compare(const std::vector<Phase>& phases, const IntegrationSetup& integration, InstructionSet set) {
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, integration);
  CaseDynamics case_dynamics;
  const Outcomes outcomes = run(structure, phases, all_of(phases), set, case_dynamics);
  EXPECT_EQ(outcomes.size(), phases.size());
  Comparison c;
  for (const auto& [id, o] : outcomes) {
    EXPECT_TRUE(o.finished()) << explanation(o);
    const Phase& p = phases[id];
    PhaseDynamics dynamics(p.model, p.own_setup());
    const PhaseOutcome expected = simulate_phase(dynamics, {p.start, p.begin, p.end}, integration);
    EXPECT_TRUE(expected.finished) << expected.failure;
    if (structure.control.by_case) {
      const PhaseSetup &left = case_dynamics.at(id)->setup(), &alone = dynamics.setup();
      c.commands = std::max(c.commands, difference(*left.clock, *alone.clock));
      if (alone.actuators.thrusters)
        c.thrusters = std::max(c.thrusters, difference(*left.actuators.thrusters, *alone.actuators.thrusters));
    } else if (p.setup.clock) {
      ControlClock clock = *p.setup.clock;
      end_control(*lane_motion(structure, p.model, p.setup, p.begin, p.end), o, clock);
      c.commands = std::max(c.commands, difference(clock, *dynamics.setup().clock));
    }
    c.state = std::max(c.state, difference({o.q, o.v}, expected.end_state));
    c.work = std::max(c.work, difference(o.integrals, expected.integrals));
    EXPECT_FALSE(o.trees.empty());
    for (const LaneTreeRecord& tree : o.trees) {
      c.linear = std::max(c.linear, tree.linear_deviation / tree.linear_scale);
      c.angular = std::max(c.angular, tree.angular_deviation / tree.angular_scale);
      c.energy = std::max(c.energy, tree.energy_deviation / tree.energy_scale);
    }
    c.steps += o.steps, c.scalar_steps += expected.steps;
  }
  return c;
}

inline void expect_alike(const char* what, const std::vector<Phase>& phases, double bound,
                         const IntegrationSetup& integration = tight(), double momentum = 1e-11,
                         double more_steps = 0.05) {
  for (InstructionSet set : supported_instruction_sets()) {
    const Comparison c = compare(phases, integration, set);
    std::printf("%-28s %-8s state %.1e work %.1e momentum %.1e %.1e energy %.1e steps %ld (scalar %ld)%s\n", what,
                std::string(name(set)).c_str(), c.state, c.work, c.linear, c.angular, c.energy, c.steps, c.scalar_steps,
                worst_of(c.state, bound));
    EXPECT_LT(c.state, bound) << what;
    EXPECT_LT(c.work, 10 * bound) << what;
    EXPECT_LT(c.commands, 100 * bound) << what;
    EXPECT_LT(c.thrusters, 10 * bound) << what;
    EXPECT_LT(c.linear, momentum);
    EXPECT_LT(c.angular, momentum);
    EXPECT_LT(c.energy, 1e-10);
    EXPECT_NEAR(static_cast<double>(c.steps), static_cast<double>(c.scalar_steps),
                more_steps * static_cast<double>(c.scalar_steps) + 2);
  }
}

inline void expect_same_bits(const LaneOutcome& a, const LaneOutcome& b) {
  const auto same = [](const std::vector<double>& x, const std::vector<double>& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) == 0;
  };
  EXPECT_TRUE(same(a.q, b.q));
  EXPECT_TRUE(same(a.v, b.v));
  EXPECT_EQ(a.status, b.status);
  const auto numbers = [](const LaneOutcome& o) {
    std::vector<double> all{o.time, o.quaternion_defect, static_cast<double>(o.steps), static_cast<double>(o.rejected),
                            static_cast<double>(o.evaluations)};
    const std::vector<double> integrals = numbers_of(o.integrals);
    all.insert(all.end(), integrals.begin(), integrals.end());
    for (const LaneLoopDefect& d : {o.loops.unprojected, o.loops.largest})
      all.insert(all.end(), {d.position, d.angle, d.velocity, d.angular_velocity});
    all.insert(all.end(), {o.loops.rank, o.loops.corrections, o.loops.error_estimates});
    for (const LaneTreeRecord& t : o.trees) {
      all.insert(all.end(),
                 {t.linear_deviation, t.angular_deviation, t.energy_deviation, t.linear_scale, t.angular_scale,
                  t.energy_scale, t.largest_linear, t.largest_angular, t.largest_energy, t.start.com[1],
                  t.end.size.energy, t.end.size.second_moment, t.end.com[0], t.end.angular[2]});
    }
    return all;
  };
  EXPECT_TRUE(same(numbers(a), numbers(b)));
}

/// Identical bits in any order, with any neighbours and, for fused products, for any width. At least twelve phases.
inline void expect_bits_of_the_case_alone(const std::vector<Phase>& phases) {
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
  const Outcomes reference = run(structure, phases, all_of(phases), InstructionSet::one_lane);
  for (InstructionSet set : supported_instruction_sets()) {
    SCOPED_TRACE(std::string(name(set)));
    std::vector<int> order = all_of(phases);
    const Outcomes forwards = run(structure, phases, order, set);
    std::reverse(order.begin(), order.end());
    const Outcomes backwards = run(structure, phases, order, set);
    const Outcomes few = run(structure, phases, {7, 3, 11}, set);
    const Outcomes alone = run(structure, phases, {7}, set);
    const bool fused = set != InstructionSet::sse2;
    ASSERT_EQ(forwards.size(), phases.size());
    for (const auto& [id, o] : forwards) {
      if (fused) expect_same_bits(o, reference.at(id));
      expect_same_bits(o, backwards.at(id));
    }
    for (const auto& [id, o] : few) expect_same_bits(o, forwards.at(id));
    expect_same_bits(alone.at(7), forwards.at(7));
  }
}

}  // namespace grapnel::testing
