/// Many phases in lanes, against scalar integration.

#include <gtest/gtest.h>
#include <malloc.h>

#include <cmath>

#include "lanes/lane_phases.hpp"

namespace grapnel::testing {
namespace phase_test {

TEST(LanePhase, FreeJointsAgree) { expect_alike("free", random_phases(1, 11, {}), 3e-10); }

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

// Sampled control: commands are computed at ticks and held, without delay or delayed by 1.3 and 2.5 periods.
TEST(LanePhase, SampledControlAgrees) {
  Kind kind;
  for (const double delay : {0.0, 1.3, 2.5}) {
    SCOPED_TRACE(delay);
    kind.sampled = ControlTiming{0.02, 0.02 * delay};
    kind.control = JointControl::pd, kind.friction = kind.noise = kind.attitude = true;
    kind.effort = 0.5;
    expect_alike("sampled pd", random_phases(12, 9, kind), 1e-9);
    kind.control = JointControl::computed_torque, kind.friction = kind.noise = kind.attitude = false;
    kind.effort = std::numeric_limits<double>::infinity();
    expect_alike("sampled computed torque", random_phases(13, 9, kind), 1e-9);
  }
}

TEST(LanePhase, SampledBitsDependOnTheCaseAlone) {
  Kind kind;
  kind.control = JointControl::pd;
  kind.friction = kind.attitude = true;
  kind.sampled = ControlTiming{0.05, 0.07};
  expect_bits_of_the_case_alone(random_phases(14, 13, kind));
}

// Gains too high for the period: the rates grow, and the run ends as the scalar run does.
TEST(LanePhase, UnstableSampledControlIsReported) {
  Kind kind;
  kind.control = JointControl::pd;
  kind.sampled = ControlTiming{0.05, 0};
  std::vector<Phase> phases = random_phases(15, 3, kind);
  for (Phase& p : phases) {
    for (JointDrive& drive : p.setup.drives) drive.kd = 100;
  }
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
  for (const auto& [id, o] : run(structure, phases, all_of(phases), supported_instruction_sets().back())) {
    EXPECT_EQ(o.status, LaneStatus::unstable_control);
    EXPECT_NE(explanation(o).find("sampled control is unstable"), std::string::npos) << explanation(o);
    PhaseDynamics dynamics(phases[id].model, phases[id].own_setup());
    const PhaseOutcome alone =
        simulate_phase(dynamics, {phases[id].start, phases[id].begin, phases[id].end}, tight(1e-9));
    EXPECT_FALSE(alone.finished);
    EXPECT_EQ(alone.end_time, o.time);
    EXPECT_NE(alone.failure.find("sampled control is unstable"), std::string::npos) << alone.failure;
  }
}

TEST(LanePhase, ErrorsShrinkWithTheTolerance) {
  const std::vector<Phase> phases = random_phases(9, 8, {});
  std::vector<State> truth;
  for (const Phase& p : phases) {
    PhaseDynamics dynamics(p.model, p.setup);
    truth.push_back(simulate_phase(dynamics, {p.start, p.begin, p.end}, tight(1e-14)).end_state);
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

TEST(LanePhase, RejectsInvalidCases) {
  const std::vector<Phase> phases = random_phases(11, 2, {});
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
  const auto once = [&](auto change) {
    bool given = false;
    const LaneCaller caller{[&](LaneCase& c) {
                              if (given) return false;
                              const Phase& p = phases[0];
                              lane_case(structure, p.model, p.setup, p.start,
                                        lane_motion(structure, p.model, p.setup, 1, 2), c);
                              change(c);
                              return given = true;
                            },
                            [](const LaneCase&, const LaneOutcome&) { throw std::runtime_error("from the sink"); }};
    run_lanes(structure, caller, InstructionSet::one_lane);
  };
  EXPECT_THROW(once([](LaneCase& c) { c.links.pop_back(); }), std::invalid_argument);
  EXPECT_THROW(once([](LaneCase& c) { c.motion = nullptr; }), std::invalid_argument);
  EXPECT_THROW(once([](LaneCase&) {}), std::runtime_error);  // exceptions of the sink pass through
  PhaseSetup held = phases[0].setup;
  held.held_root = phases[0].model.body_index("b0");
  const LaneStructure structure_held = lane_structure(phases[0].model, held, tight());
  LaneCase c;
  EXPECT_THROW(lane_case(structure_held, phases[0].model, phases[0].setup, phases[0].start, nullptr, c),
               std::invalid_argument);
  EXPECT_THROW(lane_case(structure, phases[0].model, held, phases[0].start, nullptr, c), std::invalid_argument);
  held.held_root = phases[0].model.body_index("b1");
  EXPECT_EQ(lane_obstacle(phases[0].model, held, tight()), "the held root is not free, or is under attitude control");
  EXPECT_THROW(lane_structure(phases[0].model, held, tight()), std::invalid_argument);
  const auto obstacle_of = [&](const std::function<void(JointDescription&)>& change) {
    ModelBuilder builder;
    bool done = false;
    for (const Body& b : phases[0].model.bodies()) {
      BodyDescription d = b.description;
      if (!done && b.parent >= 0 && has_one_axis(d.joint.type)) change(d.joint), done = true;
      builder.add(d);
    }
    return lane_obstacle(builder.build(), phases[0].setup, tight());
  };
  EXPECT_EQ(obstacle_of([](JointDescription&) {}), "");
  EXPECT_EQ(obstacle_of([](JointDescription& j) { j.friction.model = JointFriction::Model::sticking; }),
            "joints stick");
  EXPECT_EQ(obstacle_of([](JointDescription& j) { j.limits.stop = JointStop{}; }), "joints have stops");
  EXPECT_EQ(obstacle_of([](JointDescription& j) { j.motor = JointMotor{}; }), "joints have motors");
  EXPECT_EQ(obstacle_of([](JointDescription& j) {
              j.rotor_inertia = 1, j.rotor_axis = Vector3d{0, 0, 1};
            }),
            "rotors store momentum");
  const Phase other = random_phases(12, 1, {})[0];
  EXPECT_THROW(lane_case(structure, other.model, other.setup, other.start, nullptr, c), std::invalid_argument);
}

TEST(LanePhase, MemoryDoesNotGrow) {
  const Phase p = random_phases(13, 1, {})[0];
  const LaneStructure structure = lane_structure(p.model, p.setup, tight(1e-6));
  const auto motion = lane_motion(structure, p.model, p.setup, 1, 1.05);
  int given = 0;
  std::size_t early = 0, late = 0;
  const LaneCaller caller{
      [&](LaneCase& c) {
        if (given == 3000) return false;
        lane_case(structure, p.model, p.setup, p.start, motion, c);
        return ++given > 0;
      },
      [&](const LaneCase&, const LaneOutcome&) { (early == 0 && given > 100 ? early : late) = mallinfo2().uordblks; }};
  run_lanes(structure, caller, supported_instruction_sets().back());
  std::printf("heap in use after 100 cases %zu, after 3000 %zu\n", early, late);
  EXPECT_NEAR(static_cast<double>(late), static_cast<double>(early), 4096);
}

TEST(LanePhase, RejectsAPrescribedJointAtRestWithARate) {
  Kind kind;
  kind.control = JointControl::prescribed;
  const Phase p = random_phases(8, 1, kind)[0];
  PhaseSetup setup = p.setup;
  std::get<JointPath>(setup.drives[0].trajectory.segments[0].shape).end_rate = 0.1;
  const LaneStructure structure = lane_structure(p.model, setup, tight());
  EXPECT_NO_THROW(lane_motion(structure, p.model, setup, 1, 2.3));
  EXPECT_THROW(lane_motion(structure, p.model, setup, 1, 3), std::invalid_argument);
  EXPECT_EQ(lane_obstacle(p.model, setup, tight(), 1, 2.3), "");
  EXPECT_NE(lane_obstacle(p.model, setup, tight(), 1, 3), "");
}

/// All kinds of joint control.
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
    expect_bits_of_the_case_alone(random_phases(index++, 13, kind));
  }
}

TEST(LanePhase, FailingCaseDoesNotAffectOthers) {
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
  for (JointDrive& drive : phases[9].setup.drives) drive.kp = -1e7;  // unstable
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
