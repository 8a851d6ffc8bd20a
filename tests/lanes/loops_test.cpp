/// Closed loops in lanes against scalar integration: two, three and four arms on one or two targets, planar (with
/// redundant rows) and spatial; free and driven joints; and cases that leave the lanes.

#include <gtest/gtest.h>

#include <cmath>

#include "constraint/closed_case.hpp"
#include "lanes/lane_phases.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace loops_test {

struct Loops {
  JointControl control = JointControl::free;
  bool friction = false;
  double effort = std::numeric_limits<double>::infinity();
  int most_driven = 1000;  // number of driven joints, counted from the last
  double rate = 0.5;       // initial joint rates
  double length = 0.6;     // [s]
  bool gravity = false;
  bool turned = false;  // closure frames rotated at random, so that redundant rows are not aligned with axes
  std::optional<ControlTiming> sampled = {};
};

// An initial state on the closures, near `start`.
State closed_near(const Model& model, const std::vector<LoopClosure>& closures, State start, const Loops& kind,
                  Random& random) {
  for (int joint : model.joints()) {
    const Body& body = model.bodies()[static_cast<std::size_t>(joint)];
    start.q[static_cast<std::size_t>(body.q)] += random.uniform(-0.02, 0.02);
    start.v[static_cast<std::size_t>(body.v)] *= kind.rate * random.uniform(0.8, 1.2);
  }
  Workspace workspace(model);
  LoopSolver solver(model, closures);
  EXPECT_TRUE(solver.project({}, workspace, start.q, start.v).converged);
  return start;
}

std::vector<Phase> phases_of(const ClosedCase& c, int index, int count, const Loops& kind) {
  Random random(7000 + index);
  Model nominal = c.model;
  if (kind.friction || std::isfinite(kind.effort))
    nominal = with_friction(nominal, kind.friction ? 0.4 : 0, kind.friction ? 0.3 : 0, kind.effort);
  std::vector<LoopClosure> closures = c.closures;
  if (kind.turned) {
    for (LoopClosure& closure : closures) {
      const Rotationd R = random.rotation();
      closure.X_AC.R = closure.X_AC.R * R, closure.X_BD.R = closure.X_BD.R * R;
      closure.hinge_C = transposed_times(R, closure.hinge_C);
    }
  }
  std::vector<std::uint8_t> is_driven(nominal.joints().size());
  for (std::size_t j = is_driven.size(); j-- > 0;)
    is_driven[j] = is_driven.size() - j <= static_cast<std::size_t>(kind.most_driven);
  std::vector<Phase> phases;
  for (int i = 0; i < count; ++i) {
    Phase p{perturbed(nominal, random), {}, {}, 1, 1 + kind.length};
    p.setup.closures = closures;
    p.start = closed_near(p.model, closures, c.state, kind, random);
    p.setup.drives = random_drives(p.model, p.start, kind.control, 1.3, random, 1);
    for (std::size_t j = 0; j < p.setup.drives.size(); ++j) {
      JointDrive& drive = p.setup.drives[j];
      if (is_driven[j] == 0) drive = {};
      JointPath* path =
          drive.trajectory.segments.empty() ? nullptr : std::get_if<JointPath>(&drive.trajectory.segments[0].shape);
      // Braked joints are at rest.
      if (path && kind.control == JointControl::prescribed)
        path->end = path->start, path->start_rate = path->end_rate = 0;
    }
    if (kind.gravity) p.setup.gravity = random.vector(2);
    if (kind.sampled) {
      for (JointDrive& drive : p.setup.drives) drive.kp = random.uniform(1, 3), drive.kd = random.uniform(0.5, 1);
      p.setup.clock = std::make_shared<ControlClock>(*kind.sampled, p.model.joints().size());
    }
    phases.push_back(std::move(p));
  }
  return phases;
}

// Whether lanes support the loops of a random closed case on a free base.
bool is_for_lanes(const ClosedCase& c) {
  PhaseSetup setup;
  setup.closures = c.closures;
  return !c.closures.empty() && lane_obstacle(c.model, setup, tight()).empty();
}

// The first cases, from `first` on in steps, whose loops lanes support.
std::vector<int> cases_for_lanes(int first, int step, int count) {
  std::vector<int> found;
  for (int index = first; static_cast<int>(found.size()) < count; index += step) {
    if (is_for_lanes(random_closed(index))) found.push_back(index);
  }
  return found;
}

// Loop closure in lanes and in scalar integration: equal ranks, records of similar size, and closed loops.
void expect_accounts_alike(const std::vector<Phase>& phases, const IntegrationSetup& integration) {
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, integration);
  for (InstructionSet set : supported_instruction_sets()) {
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
      const Phase& p = phases[id];
      PhaseDynamics dynamics(p.model, p.own_setup());
      const LoopOutcome alone = simulate_phase(dynamics, {p.start, p.begin, p.end}, integration).loops;
      EXPECT_EQ(o.loops.rank, alone.rank);
      EXPECT_LE(o.loops.rank, alone.rows);
      for (const double open : {o.loops.largest.position, o.loops.largest.angle, o.loops.largest.velocity,
                                o.loops.largest.angular_velocity})
        EXPECT_LT(open, 3e-13);  // measured 6e-14
      // Maxima over single steps, whose sizes depend on rounding errors.
      const double before = std::max(alone.unprojected.position, alone.unprojected.angle),
                   here = std::max(o.loops.unprojected.position, o.loops.unprojected.angle);
      EXPECT_LT(here, 4 * before + 1e-13);
      EXPECT_GT(here, before / 4 - 1e-13);
      const double relative = integration.relative_tolerance;
      EXPECT_NEAR(relative * o.loops.corrections, alone.correction_total, 0.7 * alone.correction_total + 1e-12);
      EXPECT_NEAR(relative * o.loops.error_estimates + 1e-12 * static_cast<double>(o.steps + 1),
                  alone.integration_error, 0.7 * alone.integration_error);
    }
  }
}

// Rounding errors influence the steps, strongly for small motions.
void expect_loops_alike(const char* what, int index, const Loops& kind, double bound = 3e-10, double more_steps = 0.2) {
  SCOPED_TRACE(seed_note(index) + ", " + what);
  const std::vector<Phase> phases = phases_of(random_closed(index), index, test::repetitions(4) + 1, kind);
  expect_alike(what, phases, bound, tight(3e-13), 1e-11, more_steps);
}

TEST(LaneLoops, FreeJointsAgree) {
  for (int index : cases_for_lanes(0, 1, test::repetitions(14) + 1)) expect_loops_alike("free", index, {});
}

// Parallel axes of a loop: three rows of a rigid closure are redundant, in any axes.
TEST(LaneLoops, RedundantRowsAgree) {
  Loops kind;
  kind.turned = true;
  bool any = false;
  for (int index : cases_for_lanes(2, 3, test::repetitions(6) + 1)) {
    expect_loops_alike("redundant", index, kind);
    const std::vector<Phase> phases = phases_of(random_closed(index), index, 5, kind);
    expect_accounts_alike(phases, tight(1e-10));
    PhaseDynamics dynamics(phases[0].model, phases[0].setup);
    const PhaseOutcome alone = simulate_phase(dynamics, {phases[0].start, 1, 1.01}, tight());
    any = any || alone.loops.rank < alone.loops.rows;
  }
  EXPECT_TRUE(any);
}

// Two arms on one target, in a planar loop except for the changes of a test.
struct PlanarLoop {
  const char* what;
  int turn_rows, push_rows;  // expected numbers of rows
  GraspModel model = GraspModel::rigid;
  Vector3d hinge{0, 0, 1};
  JointType last = JointType::revolute;  // of arm a, with its axis
  Vector3d axis{0, 0, 1};
};

// The system is rotated at random, so that normals are not aligned with link or grasp axes. `near`: starts near the
// zero posture, in which the grasp is defined, otherwise in that posture.
Phase planar_loop(const PlanarLoop& loop, Random& random, bool near = true) {
  ModelBuilder builder;
  const Rotationd R = random.rotation();
  const auto add = [&](const std::string& name, const std::string& parent, JointType type, const Posed& X_PF) {
    BodyDescription b;
    b.name = b.joint.name = name, b.parent = parent, b.joint.type = type, b.X_PF = X_PF;
    b.mass = random.uniform(1, 3), b.com = random.vector(0.2), b.inertia = random_inertia(b.mass, 0.6, random);
    if (name == "a3") b.joint.type = loop.last, b.joint.axis = loop.axis;
    builder.add(b);
  };
  const auto along = [&](double x, double y) {
    return Posed{rotation_about({0, 0, 1}, random.uniform(-1, 1)), {x, y, random.uniform(-0.1, 0.1)}};
  };
  add("base", "", JointType::free, Posed::identity());
  add("a1", "base", JointType::revolute, {R, {0.5, 0, 0}});
  add("a2", "a1", JointType::revolute, along(0.8, 0)), add("a3", "a2", JointType::revolute, along(0.7, 0.2));
  add("target", "a3", JointType::fixed, along(0.3, 0.1));
  add("b1", "base", JointType::revolute, {R, {-0.5, 0.1, 0}});
  add("b2", "b1", JointType::revolute, along(-0.7, 0.3)), add("b3", "b2", JointType::revolute, along(0.6, 0.4));
  Phase p{builder.build(), {}, {}, 0, 1.5};
  LoopClosure grasp;
  grasp.name = "b on target";
  grasp.body_a = p.model.body_index("b3"), grasp.body_b = p.model.body_index("target");
  const Rotationd R_C = random.rotation();
  grasp.X_AC = {R_C, random.vector(0.4)};
  const Kinematics k = forward_kinematics(p.model, zero_state(p.model));
  grasp.X_BD = inverse(k.X_WB[grasp.body_b]) * (k.X_WB[grasp.body_a] * grasp.X_AC);
  grasp.model = loop.model;
  grasp.hinge_C = transposed_times(R_C, loop.hinge);  // of b3's axes, of which z is the normal
  p.setup.closures = {grasp};
  p.start = zero_state(p.model);
  if (near) p.start = closed_near(p.model, p.setup.closures, p.start, {}, random);
  for (int i = 0; i < p.model.velocities(); ++i) p.start.v[static_cast<std::size_t>(i)] = random.uniform(-0.4, 0.4);
  Workspace workspace(p.model);
  LoopSolver(p.model, p.setup.closures).close_velocities(p.start.q, {}, workspace, p.start.v);
  return p;
}

TEST(LaneLoops, PlanarLoopsHaveRowsForMovableDirections) {
  const double tilt = 0.6;
  const Vector3d tilted{0, std::sin(tilt), std::cos(tilt)}, across{1, 0, 0};
  using enum GraspModel;
  const PlanarLoop loops[] = {
      {"rigid", 1, 2},
      {"hinge along the normal", 0, 2, hinge},
      {"hinge off it", 1, 2, hinge, tilted},
      {"hinge in the plane", 1, 2, hinge, across},
      {"point", 0, 2, point},
      {"sliding in the plane", 1, 2, rigid, {}, JointType::prismatic, across},
      {"sliding off it", 1, 3, rigid, {}, JointType::prismatic, tilted},
      {"sliding off it to a hinge", 0, 3, hinge, {0, 0, 1}, JointType::prismatic, {0, 0, 1}},
      {"an axis off the normal", 3, 3, rigid, {}, JointType::revolute, tilted},
      {"a ball joint", 3, 3, rigid, {}, JointType::spherical},
  };
  for (const PlanarLoop& loop : loops) {
    SCOPED_TRACE(loop.what);
    Random random(11);
    std::vector<Phase> phases;
    for (int i = 0; i < 5; ++i) phases.push_back(planar_loop(loop, random));
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
    ASSERT_EQ(structure.loops.size(), 1U);
    EXPECT_EQ(structure.loops[0].turn_rows, loop.turn_rows);
    EXPECT_EQ(structure.loops[0].push_rows, loop.push_rows);
    expect_alike(loop.what, phases, 1e-10, tight(3e-13), 1e-11, 0.2);
    expect_accounts_alike(phases, tight(1e-11));
  }
}

// Axes with deviations from parallel above rounding error have all rows; the rank decides whether they count.
TEST(LaneLoops, PlanarityIsDecidedToRoundingError) {
  Random random(13);
  for (const double tilt : {1e-9, 1e-15}) {
    const Phase p =
        planar_loop({"tilted", 0, 0, GraspModel::rigid, {}, JointType::revolute, {0, std::sin(tilt), std::cos(tilt)}},
                    random, false);
    EXPECT_EQ(lane_structure(p.model, p.setup, tight()).loops[0].rows(), tilt > 1e-12 ? 6 : 3);
  }
}

// A grasp with an out-of-plane defect cannot be closed by its joints: the case leaves the lanes.
TEST(LaneLoops, LeaveIfPlanarLoopsCannotClose) {
  Random random(12);
  std::vector<Phase> phases;
  for (int i = 0; i < 5; ++i) phases.push_back(planar_loop({"rigid", 1, 2}, random));
  phases[2].setup.closures[0].X_AC.p += Vector3d{0, 0, 1e-6};  // in the axes of b3, whose z is the normal
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
  for (InstructionSet set : supported_instruction_sets()) {
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set))
      EXPECT_EQ(o.status, id == 2 ? LaneStatus::loops_in_doubt : LaneStatus::finished) << id << explanation(o);
  }
}

TEST(LaneLoops, AccountsAgree) {
  for (int index : cases_for_lanes(0, 1, test::repetitions(5) + 1))
    expect_accounts_alike(phases_of(random_closed(index), index, 5, {}), tight(1e-9));
}

TEST(LaneLoops, DrivesAgree) {
  Loops pd, limited, braked, computed, gravity, sampled;
  pd.control = JointControl::pd, pd.friction = true;
  limited = pd, limited.effort = 8;
  braked.control = JointControl::prescribed, braked.most_driven = 2, braked.friction = true;
  computed.control = JointControl::computed_torque, computed.most_driven = 1, computed.friction = true;
  gravity.gravity = true;
  sampled.control = JointControl::pd, sampled.sampled = ControlTiming{0.05, 0.07};
  for (int index : cases_for_lanes(0, 1, test::repetitions(2) + 1)) {
    expect_loops_alike("pd, friction", index, pd, 1e-9);
    expect_loops_alike("pd, friction, limits", index, limited, 3e-8);  // which make accelerations nonsmooth
    expect_loops_alike("braked", index, braked, 1e-9, 0.5);
    expect_loops_alike("computed torque", index, computed, 3e-8);
    expect_loops_alike("gravity", index, gravity, 1e-9);
    expect_loops_alike("sampled pd", index, sampled, 1e-9);
  }
}

// One evaluation: over one short step, velocities change by the accelerations.
TEST(LaneLoops, AccelerationsAgree) {
  Loops kind;
  kind.length = 1e-3;
  double worst = 0;
  for (int index : cases_for_lanes(0, 1, test::repetitions(20) + 1)) {
    const std::vector<Phase> phases = phases_of(random_closed(index), index, 5, kind);
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
    for (InstructionSet set : supported_instruction_sets()) {
      for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
        const Phase& p = phases[id];
        PhaseDynamics dynamics(p.model, p.own_setup());
        const State alone = simulate_phase(dynamics, {p.start, p.begin, p.end}, tight(1e-9)).end_state;
        const State start = simulate_phase(dynamics, {p.start, p.begin, p.begin}, tight(1e-9)).end_state;
        double change = 0, off = 0, fastest = 0;
        for (std::size_t i = 0; i < alone.v.size(); ++i) {
          change = std::max(change, std::abs(alone.v[i] - start.v[i]));
          off = std::max(off, std::abs(alone.v[i] - o.v[i]));
          fastest = std::max(fastest, std::abs(alone.v[i]));
        }
        EXPECT_GT(change, 1e-8);
        worst = std::max(worst, off / fastest);
      }
    }
  }
  std::printf("[ measured ] velocities after one step: %.1e of them\n", worst);
  EXPECT_LT(worst, 1e-13);
}

TEST(LaneLoops, BitsDependOnTheCaseAlone) {
  Loops turned, braked;
  turned.turned = true;
  braked.control = JointControl::prescribed, braked.most_driven = 2;
  for (int index : cases_for_lanes(2, 3, 2))
    expect_bits_of_the_case_alone(phases_of(random_closed(index), index, 13, turned));
  for (int index : cases_for_lanes(0, 3, 2))
    expect_bits_of_the_case_alone(phases_of(random_closed(index), index, 13, braked));
}

// --- Cases that leave the lanes.
// --------------------------------------------------------------------------------------

// Two planar arms with two links each, grasping one target. With both elbows at `bend` the system is nearly collinear,
// and the closure is nearly singular along that line.
Phase stretched(double bend) {
  ModelBuilder builder;
  const auto add = [&](const std::string& name, const std::string& parent, JointType type, double x) {
    BodyDescription b;
    b.name = b.joint.name = name, b.parent = parent, b.joint.type = type, b.joint.axis = {0, 0, 1};
    b.X_PF.p = {x, 0, 0};
    b.mass = 2, b.com = {0.1, 0.02, 0}, b.inertia = Symmetric3d::diagonal(0.2, 0.3, 0.4);
    builder.add(b);
  };
  add("base", "", JointType::free, 0);
  add("a1", "base", JointType::revolute, 0.5), add("a2", "a1", JointType::revolute, 1);
  add("target", "a2", JointType::fixed, 1);
  add("b1", "base", JointType::revolute, -0.5), add("b2", "b1", JointType::revolute, 2);
  Phase p{builder.build(), {}, {}, 0, 1};
  p.start = zero_state(p.model);
  p.start.q[static_cast<std::size_t>(p.model.bodies()[p.model.body_index("a2")].q)] = bend;
  p.start.q[static_cast<std::size_t>(p.model.bodies()[p.model.body_index("b2")].q)] = -bend;
  LoopClosure grasp;
  grasp.name = "b on target";
  grasp.body_a = p.model.body_index("b2"), grasp.body_b = p.model.body_index("target");
  grasp.X_AC = {Rotationd::identity(), {0.9, 0, 0}};
  const Kinematics k = forward_kinematics(p.model, p.start);
  grasp.X_BD = inverse(k.X_WB[grasp.body_b]) * (k.X_WB[grasp.body_a] * grasp.X_AC);
  grasp.model = GraspModel::point;
  p.setup.closures = {grasp};
  return p;
}

TEST(LaneLoops, LeaveWhenRanksAreDoubtful) {
  const std::vector<Phase> phases{stretched(0.3), stretched(1e-6), stretched(0), stretched(0.2), stretched(2e-6)};
  for (InstructionSet set : supported_instruction_sets()) {
    SCOPED_TRACE(std::string(name(set)));
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
      const bool in_doubt = id == 1 || id == 4;
      EXPECT_EQ(o.status, in_doubt ? LaneStatus::loops_in_doubt : LaneStatus::finished) << id << explanation(o);
      if (in_doubt) {
        EXPECT_NE(explanation(o).find("closed loops approach a configuration"), std::string::npos);
        continue;
      }
      EXPECT_EQ(o.loops.rank, id == 2 ? 1 : 2);  // of three rows
    }
  }
}

// Joints driven against the loop: no motion is possible, in lanes or in scalar integration.
TEST(LaneLoops, LeaveWhenDrivesContradict) {
  std::vector<Phase> phases;
  for (int i = 0; i < 5; ++i) {
    Phase p = stretched(0.3 + 0.1 * i);
    for (int joint : p.model.joints()) {
      const Body& body = p.model.bodies()[static_cast<std::size_t>(joint)];
      const double at = p.start.q[static_cast<std::size_t>(body.q)];
      const bool turns = i < 3;
      p.setup.drives.push_back(
          {JointControl::prescribed, {0, JointPath{JointProfile::quintic, 2, at, at + (turns ? 0.2 : 0)}}});
    }
    phases.push_back(p);
  }
  for (InstructionSet set : supported_instruction_sets()) {
    const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
      PhaseDynamics dynamics(phases[id].model, phases[id].setup);
      const bool alone = simulate_phase(dynamics, {phases[id].start, 0, 1}, tight(1e-9)).finished;
      EXPECT_EQ(alone, id >= 3);
      EXPECT_EQ(o.finished(), alone) << explanation(o);
    }
  }
}

TEST(LaneLoops, RequireProjection) {
  Phase p = stretched(0.3);
  EXPECT_EQ(lane_obstacle(p.model, p.setup, tight()), "");
  p.setup.loop_feedback = 10;
  EXPECT_EQ(lane_obstacle(p.model, p.setup, tight()), "loops are not closed by projection");
  p.setup.loop_feedback = 0, p.setup.project_loops = false;
  EXPECT_EQ(lane_obstacle(p.model, p.setup, tight()), "loops are not closed by projection");
}

// A case with another grasp model has another structure.
TEST(LaneLoops, HaveOneStructure) {
  const Phase p = stretched(0.3);
  Phase other = p;
  other.setup.closures[0].model = GraspModel::rigid;
  const LaneStructure structure = lane_structure(p.model, p.setup, tight());
  LaneCase c;
  const auto motion = lane_motion(structure, p.model, p.setup, 0, 1);
  EXPECT_NO_THROW(lane_case(structure, p.model, p.setup, p.start, motion, c));
  EXPECT_THROW(lane_case(structure, other.model, other.setup, other.start, motion, c), std::invalid_argument);
}

}  // namespace loops_test
}  // namespace grapnel::testing
