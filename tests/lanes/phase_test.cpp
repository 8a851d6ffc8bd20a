/// Many phases at once in lanes, against one at a time.

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>
#include <cstring>
#include <map>

#include "grapnel/lanes/lane_phase_setup.hpp"
#include "simulate/phase_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace phase_test {

using namespace lanes;

/// One phase as both ways of integrating take it.
struct Phase {
  Model model;
  PhaseSetup setup;
  State start;
  double begin = 0, end = 1;
};

using Outcomes = std::map<std::uint64_t, LaneOutcome>;

/// Runs cases of one structure; `order` gives their ids.
Outcomes run(const LaneStructure& structure, const std::vector<Phase>& phases, const std::vector<int>& order,
             InstructionSet set) {
  Outcomes outcomes;
  std::size_t next = 0;
  run_lanes(
      structure,
      [&](LaneCase& c) {
        if (next == order.size()) return false;
        const Phase& p = phases[static_cast<std::size_t>(order[next])];
        c.id = static_cast<std::uint64_t>(order[next++]);
        lane_case(structure, p.model, p.setup, p.start, lane_motion(structure, p.model, p.setup, p.begin, p.end), c);
        return true;
      },
      [&](const LaneCase& c, const LaneOutcome& o) {
        EXPECT_EQ(c.id, o.id);
        EXPECT_TRUE(outcomes.emplace(o.id, o).second) << "case " << o.id << " came twice";
      },
      set);
  return outcomes;
}

std::vector<int> all_of(const std::vector<Phase>& phases) {
  std::vector<int> order;
  for (std::size_t i = 0; i < phases.size(); ++i) order.push_back(static_cast<int>(i));
  return order;
}

/// The same robot with every mass, centre and inertia changed by up to 20 %.
Model perturbed(const Model& model, Random& random) {
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
};

/// Cases of a random robot with two free targets beside it; trajectories have ends inside the phase.
std::vector<Phase> random_phases(int index, int count, const Kind& kind) {
  Random random(index);
  RobotOptions options;
  options.least_bodies = 3, options.most_bodies = 8;
  options.spherical_joints = kind.spherical;
  options.targets = 2;
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
      JointPath& path = std::get<JointPath>(drive.trajectory.pieces[0].shape);
      path.profile = kind.profile;
      if (prescribed) path.end_rate = 0;
      drive.kp = random.uniform(20, 60);
      if (kind.noise) {
        drive.noise =
            NoiseSignal({1e-3, 2, static_cast<std::uint64_t>(1000 * index + i)}, static_cast<std::uint32_t>(j));
      }
    }
    phases.push_back(std::move(p));
  }
  return phases;
}

IntegrationSetup tight(double relative = 1e-12) {
  IntegrationSetup integration;
  integration.relative_tolerance = relative;
  integration.absolute_tolerance = 0.1 * relative;
  return integration;
}

const char* worst_of(double value, double bound) { return value <= bound ? "" : " <-- too large"; }

/// Largest difference of end states, and of the work done, against the scalar integration.
struct Comparison {
  double state = 0, work = 0, linear = 0, angular = 0, energy = 0;
  long steps = 0, scalar_steps = 0;
};
Comparison compare(const std::vector<Phase>& phases, const IntegrationSetup& integration, InstructionSet set) {
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, integration);
  const Outcomes outcomes = run(structure, phases, all_of(phases), set);
  EXPECT_EQ(outcomes.size(), phases.size());
  Comparison c;
  for (const auto& [id, o] : outcomes) {
    EXPECT_TRUE(o.finished()) << explanation(o);
    const Phase& p = phases[id];
    PhaseDynamics dynamics(p.model, p.setup);
    const PhaseOutcome expected = simulate_phase(dynamics, p.start, p.begin, p.end, 0, integration);
    EXPECT_TRUE(expected.finished) << expected.failure;
    c.state = std::max(c.state, difference({o.q, o.v}, expected.end_state));
    c.work = std::max({c.work, std::abs(o.motor_work - expected.integrals.motor_work),
                       std::abs(o.friction_work - expected.integrals.friction_work)});
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

void expect_alike(const char* what, const std::vector<Phase>& phases, double bound) {
  for (InstructionSet set : supported_instruction_sets()) {
    const Comparison c = compare(phases, tight(), set);
    std::printf("%-28s %-8s state %.1e work %.1e momentum %.1e %.1e energy %.1e steps %ld (scalar %ld)%s\n", what,
                std::string(name(set)).c_str(), c.state, c.work, c.linear, c.angular, c.energy, c.steps, c.scalar_steps,
                worst_of(c.state, bound));
    EXPECT_LT(c.state, bound) << what;
    EXPECT_LT(c.work, 10 * bound) << what;
    EXPECT_LT(c.linear, 1e-11);
    EXPECT_LT(c.angular, 1e-11);
    EXPECT_LT(c.energy, 1e-10);
    EXPECT_NEAR(static_cast<double>(c.steps), static_cast<double>(c.scalar_steps),
                0.05 * static_cast<double>(c.scalar_steps) + 2);
  }
}

TEST(LanePhase, FreeJointsAgreeWithOneAtATime) { expect_alike("free", random_phases(1, 11, {}), 3e-10); }

TEST(LanePhase, FreeSphericalJointsAgree) {
  Kind kind;
  kind.spherical = true;
  expect_alike("free, spherical", random_phases(2, 9, kind), 3e-10);
}

TEST(LanePhase, PdWithFrictionLimitsAndNoiseAgrees) {
  Kind kind;
  kind.control = JointControl::pd;
  kind.friction = kind.noise = true;
  kind.effort = 8;
  expect_alike("pd, friction, limits, noise", random_phases(3, 9, kind), 1e-9);
}

TEST(LanePhase, PrescribedJointsWithNoiseAgree) {
  Kind kind;
  kind.control = JointControl::prescribed;
  kind.noise = kind.friction = true;
  expect_alike("prescribed, noise", random_phases(4, 9, kind), 3e-10);
}

TEST(LanePhase, ComputedTorqueAgrees) {
  Kind kind;
  kind.control = JointControl::computed_torque;
  kind.friction = true;
  expect_alike("computed torque, friction", random_phases(5, 9, kind), 1e-9);
  kind.friction = false;
  expect_alike("computed torque", random_phases(6, 9, kind), 3e-10);
}

TEST(LanePhase, CycloidalPathsAgree) {
  Kind kind;
  kind.control = JointControl::prescribed;
  kind.profile = JointProfile::cycloidal;
  expect_alike("prescribed, cycloidal", random_phases(7, 9, kind), 3e-10);
}

TEST(LanePhase, ErrorsShrinkWithTheTolerance) {
  const std::vector<Phase> phases = random_phases(9, 8, {});
  std::vector<State> truth;
  for (const Phase& p : phases) {
    PhaseDynamics dynamics(p.model, p.setup);
    truth.push_back(simulate_phase(dynamics, p.start, p.begin, p.end, 0, tight(1e-14)).end_state);
  }
  const InstructionSet set = supported_instruction_sets().back();
  double before = std::numeric_limits<double>::infinity();
  for (double tolerance : {1e-4, 1e-7, 1e-10, 1e-13}) {
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(tolerance));
    double worst = 0;
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set))
      worst = std::max(worst, difference({o.q, o.v}, truth[id]));
    std::printf("tolerance %.0e: error %.1e\n", tolerance, worst);
    EXPECT_LT(worst, std::max(before / 30, 1e-12));
    before = worst;
  }
  EXPECT_LT(before, 1e-12);
}

TEST(LanePhase, APhaseWithoutExtentEndsWhereItStarts) {
  std::vector<Phase> phases = random_phases(10, 3, {});
  for (Phase& p : phases) p.end = p.begin;
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
  for (const auto& [id, o] : run(structure, phases, all_of(phases), supported_instruction_sets().back())) {
    EXPECT_TRUE(o.finished());
    EXPECT_EQ(o.steps, 0);
    EXPECT_LT(difference({o.q, o.v}, phases[id].start), 1e-13);
  }
}

TEST(LanePhase, RejectsWhatDoesNotFit) {
  const std::vector<Phase> phases = random_phases(11, 2, {});
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
  const auto once = [&](auto change) {
    bool given = false;
    run_lanes(
        structure,
        [&](LaneCase& c) {
          if (given) return false;
          const Phase& p = phases[0];
          lane_case(structure, p.model, p.setup, p.start, lane_motion(structure, p.model, p.setup, 1, 2), c);
          change(c);
          return given = true;
        },
        [](const LaneCase&, const LaneOutcome&) { throw std::runtime_error("from the sink"); },
        InstructionSet::one_lane);
  };
  EXPECT_THROW(once([](LaneCase& c) { c.links.pop_back(); }), std::invalid_argument);
  EXPECT_THROW(once([](LaneCase& c) { c.motion = nullptr; }), std::invalid_argument);
  EXPECT_THROW(once([](LaneCase&) {}), std::runtime_error);  // what the sink throws passes through
  PhaseSetup heavy = phases[0].setup;
  heavy.gravity = {0, 0, -1};
  EXPECT_NE(lane_obstacle(phases[0].model, heavy, tight()), "");
  EXPECT_THROW(lane_structure(phases[0].model, heavy, tight()), std::invalid_argument);
  PhaseSetup in_orbit = phases[0].setup;
  in_orbit.orbit.emplace();
  EXPECT_EQ(lane_obstacle(phases[0].model, in_orbit, tight()), "there is an orbit");
  const Phase other = random_phases(12, 1, {})[0];
  LaneCase c;
  EXPECT_THROW(lane_case(structure, other.model, other.setup, other.start, nullptr, c), std::invalid_argument);
}

TEST(LanePhase, MemoryDoesNotGrow) {
  const Phase p = random_phases(13, 1, {})[0];
  const LaneStructure structure = lane_structure(p.model, p.setup, tight(1e-6));
  const auto motion = lane_motion(structure, p.model, p.setup, 1, 1.05);
  int given = 0;
  std::size_t early = 0, late = 0;
  run_lanes(
      structure,
      [&](LaneCase& c) {
        if (given == 3000) return false;
        lane_case(structure, p.model, p.setup, p.start, motion, c);
        return ++given > 0;
      },
      [&](const LaneCase&, const LaneOutcome&) { (early == 0 && given > 100 ? early : late) = mallinfo2().uordblks; },
      supported_instruction_sets().back());
  std::printf("heap in use after 100 cases %zu, after 3000 %zu\n", early, late);
  EXPECT_NEAR(static_cast<double>(late), static_cast<double>(early), 4096);
}

TEST(LanePhase, RejectsAPrescribedJointThatStandsStillWithARate) {
  Kind kind;
  kind.control = JointControl::prescribed;
  const Phase p = random_phases(8, 1, kind)[0];
  PhaseSetup setup = p.setup;
  std::get<JointPath>(setup.drives[0].trajectory.pieces[0].shape).end_rate = 0.1;
  const LaneStructure structure = lane_structure(p.model, setup, tight());
  EXPECT_NO_THROW(lane_motion(structure, p.model, setup, 1, 2.3));
  EXPECT_THROW(lane_motion(structure, p.model, setup, 1, 3), std::invalid_argument);
  EXPECT_EQ(lane_obstacle(p.model, setup, tight(), 1, 2.3), "");
  EXPECT_NE(lane_obstacle(p.model, setup, tight(), 1, 3), "");
}

void expect_same_bits(const LaneOutcome& a, const LaneOutcome& b) {
  const auto same = [](const std::vector<double>& x, const std::vector<double>& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) == 0;
  };
  EXPECT_TRUE(same(a.q, b.q));
  EXPECT_TRUE(same(a.v, b.v));
  EXPECT_EQ(a.status, b.status);
  const auto numbers = [](const LaneOutcome& o) {
    std::vector<double> all{o.time,
                            o.motor_work,
                            o.friction_work,
                            o.quaternion_defect,
                            static_cast<double>(o.steps),
                            static_cast<double>(o.rejected),
                            static_cast<double>(o.evaluations)};
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

/// Whatever drives the joints.
std::vector<Kind> kinds() {
  Kind pd, prescribed, computed;
  pd.control = JointControl::pd, pd.friction = pd.noise = true, pd.effort = 5;
  prescribed.control = JointControl::prescribed, prescribed.noise = true;
  prescribed.profile = JointProfile::cycloidal;
  computed.control = JointControl::computed_torque, computed.friction = true;
  return {{}, pd, prescribed, computed};
}

TEST(LanePhase, BitsDependOnTheCaseAlone) {
  int index = 20;
  for (const Kind& kind : kinds()) {
    SCOPED_TRACE(index);
    const std::vector<Phase> phases = random_phases(index++, 13, kind);
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
}

TEST(LanePhase, AFailingCaseHarmsNoOther) {
  Kind kind;
  kind.control = JointControl::pd;
  std::vector<Phase> phases = random_phases(30, 12, kind);
  IntegrationSetup integration = tight(1e-9);
  integration.max_steps = 400;
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, integration);
  const Outcomes sound = run(structure, phases, all_of(phases), InstructionSet::one_lane);
  for (const auto& [id, o] : sound) EXPECT_TRUE(o.finished());
  phases[2].start.v[0] = std::numeric_limits<double>::quiet_NaN();
  phases[5].start.q.back() = std::numeric_limits<double>::infinity();
  for (JointDrive& drive : phases[8].setup.drives) drive.kp = 1e13;  // too stiff for so few steps
  for (JointDrive& drive : phases[9].setup.drives) drive.kp = -1e7;  // runs away
  const std::map<std::uint64_t, bool> fails = {{2, true}, {5, true}, {8, true}, {9, true}};
  Outcomes reference;
  for (InstructionSet set : supported_instruction_sets()) {
    SCOPED_TRACE(std::string(name(set)));
    const Outcomes outcomes = run(structure, phases, all_of(phases), set);
    ASSERT_EQ(outcomes.size(), phases.size());
    if (set == InstructionSet::one_lane) reference = outcomes;
    for (const auto& [id, o] : outcomes) {
      SCOPED_TRACE(id);
      EXPECT_EQ(o.finished(), !fails.contains(id)) << explanation(o);
      if (set == InstructionSet::sse2) continue;
      if (!fails.contains(id)) expect_same_bits(o, sound.at(id));
      EXPECT_EQ(o.status, reference.at(id).status);
      EXPECT_EQ(o.steps, reference.at(id).steps);
    }
    EXPECT_EQ(outcomes.at(2).status, LaneStatus::non_finite);
    EXPECT_EQ(outcomes.at(2).time, 1);
    EXPECT_EQ(outcomes.at(8).status, LaneStatus::too_many_steps) << explanation(outcomes.at(8));
    EXPECT_FALSE(explanation(outcomes.at(8)).empty());
  }
}

}  // namespace phase_test
}  // namespace grapnel::testing
