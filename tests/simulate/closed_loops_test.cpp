/// Phases with closed loops: outputs, stops, drives, failures.

#include <gtest/gtest.h>

#include "grapnel/constraint/loop_closure.hpp"
#include "simulate/phase_case.hpp"

namespace grapnel::testing {
namespace closed_loops_test {

// A four-bar on the ground: crank of 0.4 m, coupler 1.1 m, rocker 0.9 m, ground 1.2 m: the crank can rotate fully
// (Grashof).
struct Linkage {
  static constexpr double crank = 0.4, coupler = 1.1, rocker = 0.9, ground = 1.2;
  Model model;
  std::vector<LoopClosure> closures;
};

BodyDescription link(const std::string& name, const std::string& parent, double at, double length) {
  BodyDescription b;
  b.name = b.joint.name = name;
  b.parent = parent;
  b.X_PF.p = {at, 0, 0};
  b.joint.type = JointType::revolute;
  b.mass = 3 * length, b.com = {length / 2, 0.01, 0};
  const double I = b.mass * length * length / 12;
  b.inertia = Symmetric3d::diagonal(0.1 * I, I, I);
  return b;
}

Linkage linkage(const JointFriction& friction = {}) {
  BodyDescription ground;
  ground.name = ground.joint.name = "ground";
  ground.joint.type = JointType::fixed;
  ground.mass = 1;
  ground.inertia = Symmetric3d::diagonal(1, 1, 1);
  BodyDescription crank = link("crank", "ground", 0, Linkage::crank);
  crank.joint.friction = friction;
  Linkage l{ModelBuilder()
                .add(ground)
                .add(crank)
                .add(link("coupler", "crank", Linkage::crank, Linkage::coupler))
                .add(link("rocker", "ground", Linkage::ground, Linkage::rocker))
                .build(),
            {}};
  LoopClosure pin;
  pin.name = "pin";
  pin.body_a = l.model.body_index("rocker"), pin.X_AC = {Rotationd::identity(), {Linkage::rocker, 0, 0}};
  pin.body_b = l.model.body_index("coupler"), pin.X_BD = {Rotationd::identity(), {Linkage::coupler, 0, 0}};
  pin.model = GraspModel::hinge;
  l.closures = {pin};
  return l;
}

// Directions of rocker and coupler relative to the ground line, with the coupler above: intersection of two circles.
struct Shape {
  double rocker, coupler;
};
Shape shape(double crank) {
  const double ax = Linkage::crank * std::cos(crank), ay = Linkage::crank * std::sin(crank);
  const double dx = Linkage::ground - ax, dy = -ay, d = std::hypot(dx, dy);
  const double along = (Linkage::coupler * Linkage::coupler - Linkage::rocker * Linkage::rocker + d * d) / (2 * d);
  const double off = std::sqrt(Linkage::coupler * Linkage::coupler - along * along);
  const double x = ax + (along * dx - off * dy) / d, y = ay + (along * dy + off * dx) / d;
  return {std::atan2(y, x - Linkage::ground), std::atan2(y - ay, x - ax)};
}

int coordinate(const Linkage& l, const char* name) { return l.model.bodies()[l.model.body_index(name)].q; }
int velocity(const Linkage& l, const char* name) { return l.model.bodies()[l.model.body_index(name)].v; }

State start(const Linkage& l, double crank, double rate) {
  State s = zero_state(l.model);
  const double h = 1e-5;
  const Shape now = shape(crank), ahead = shape(crank + h), behind = shape(crank - h);
  s.q[coordinate(l, "crank")] = crank, s.v[velocity(l, "crank")] = rate;
  s.q[coordinate(l, "rocker")] = now.rocker,
                    s.v[velocity(l, "rocker")] = rate * (ahead.rocker - behind.rocker) / (2 * h);
  s.q[coordinate(l, "coupler")] = now.coupler - crank;
  s.v[velocity(l, "coupler")] = rate * (ahead.coupler - behind.coupler) / (2 * h) - rate;
  return s;
}

PhaseSetup closed(const Linkage& l) {
  PhaseSetup setup;
  setup.drives.resize(l.model.joints().size());
  setup.closures = l.closures;
  return setup;
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::acos(-1.0))); }

// The number of evaluations does not change the states: the end states are equal, bit for bit.
TEST(ClosedPhase, OutputDoesNotChangeMotion) {
  const Linkage l = linkage();
  std::vector<State> ends;
  for (const double interval : {5.0, 0.37, 0.01}) {
    PhaseDynamics dynamics(l.model, closed(l));
    const PhaseOutcome o =
        simulate_phase(dynamics, {start(l, 1.0, 3.0), 0, 5, interval}, {}, {.observe = [](const PhaseSample&) {}});
    ASSERT_TRUE(o.finished) << o.failure;
    ends.push_back(o.end_state);
  }
  EXPECT_EQ(ends[0].q, ends[1].q);
  EXPECT_EQ(ends[0].v, ends[2].v);
}

// Also between steps, every output satisfies the closures and the linkage's geometry and conserves energy.
TEST(ClosedPhase, EveryOutputIsClosed) {
  const Linkage l = linkage();
  PhaseDynamics dynamics(l.model, closed(l));
  double energy = 0, open = 0, wrong = 0, drift = 0, turned = 0;
  const State from = start(l, 1.0, 3.0);
  const PhaseOutcome o =
      simulate_phase(dynamics, {from, 0, 20, 0.013}, {}, {.observe = [&](const PhaseSample& s) {
                       const Kinematics k = forward_kinematics(l.model, s.state);
                       const ClosureDefect defect = closure_defect(l.closures[0], k);
                       open = std::max({open, defect.position, defect.angle, defect.velocity, defect.angular_velocity});
                       const double crank = s.state.q[coordinate(l, "crank")];
                       wrong = std::max(wrong, angle_between(s.state.q[coordinate(l, "rocker")], shape(crank).rocker));
                       const double T = kinetic_energy(l.model, k, s.state);
                       if (s.time == 0) energy = T;
                       drift = std::max(drift, std::abs(T - energy) / energy);
                       turned = std::max(turned, std::abs(crank));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_LT(open, 1e-13);   // measured 7.8e-15
  EXPECT_LT(wrong, 1e-13);  // measured 6e-15
  EXPECT_LT(drift, 1e-10);  // measured 6.6e-12
  EXPECT_GT(turned, 6.3);   // full rotations
  EXPECT_EQ(o.loops.rows, 5);
  EXPECT_EQ(o.loops.rank, 2);
  EXPECT_LT(o.loops.correction_total, o.loops.integration_error);
  std::printf("[ measured ] open %.2g, shape %.2g, energy %.2g, %ld steps\n", open, wrong, drift, o.steps);
}

TEST(ClosedPhase, RunsBackToStart) {
  const Linkage l = linkage();
  const State from = start(l, 1.0, 3.0);
  PhaseDynamics there(l.model, closed(l));
  const PhaseOutcome o = simulate_phase(there, {from, 0, 3, 0.5});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(difference(o.end_state, from), 0.5);
  PhaseDynamics back(l.model, closed(l));
  const PhaseOutcome p = simulate_phase(back, {o.end_state, 3, 0, 0.5});
  ASSERT_TRUE(p.finished) << p.failure;
  EXPECT_LT(difference(p.end_state, from), 1e-8);  // the initial rates are finite differences with errors of 1e-10
}

TEST(ClosedPhase, ClosedAtStopCondition) {
  const Linkage l = linkage();
  PhaseDynamics dynamics(l.model, closed(l));
  const int crank = coordinate(l, "crank");
  const PhaseOutcome o = simulate_phase(dynamics, {start(l, 1.0, 3.0), 0, 20, 0.1}, {},
                                        {.stop = [&](double, const State& s) { return 4.0 - s.q[crank]; }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_TRUE(o.stopped);
  EXPECT_NEAR(o.end_state.q[crank], 4.0, 1e-10);
  EXPECT_LT(closure_defect(l.closures[0], forward_kinematics(l.model, o.end_state)).position, 1e-14);
}

// A motor with prescribed crank motion moves the rocker according to the linkage's geometry and does the work.
TEST(ClosedPhase, ADrivenCrankMovesTheRocker) {
  const Linkage l = linkage({0.3, 0, 0.1});
  PhaseSetup setup = closed(l);
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    if (l.model.joints()[j] != l.model.body_index("crank")) continue;
    setup.drives[j].control = JointControl::prescribed;
    setup.drives[j].trajectory = {0, JointPath{JointProfile::quintic, 4, 1.0, 12.0, 0.5, 0.5}};
  }
  PhaseDynamics dynamics(l.model, setup);
  double wrong = 0, balance = 0, energy = 0, largest = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start(l, 1.0, 0.5), 0, 4, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
        wrong = std::max(
            wrong, angle_between(s.state.q[coordinate(l, "rocker")], shape(s.state.q[coordinate(l, "crank")]).rocker));
        const double T = kinetic_energy(l.model, forward_kinematics(l.model, s.state), s.state);
        if (s.time == 0) energy = T;
        largest = std::max(largest, T);
        balance = std::max(balance, std::abs(T - energy - s.integrals.motor_work - s.integrals.friction_work));
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(o.end_state.q[coordinate(l, "crank")], 12, 1e-14);
  EXPECT_LT(wrong, 1e-12);             // measured 4.4e-16
  EXPECT_LT(balance, 1e-9 * largest);  // measured 3.2e-12
  EXPECT_GT(largest, 10 * energy);
  std::printf("[ measured ] shape %.2g, balance %.2g\n", wrong, balance / largest);
}

// Two motors with contradictory commands: no motion satisfies the closed loop, and the failure reports it.
TEST(ClosedPhase, ContradictoryDrivesEndWithReason) {
  const Linkage l = linkage();
  PhaseSetup setup = closed(l);
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    const std::string& name = l.model.bodies()[l.model.joints()[j]].description.name;
    if (name == "coupler") continue;
    setup.drives[j].control = JointControl::prescribed;
    const double q = name == "crank" ? 1.0 : shape(1.0).rocker;
    setup.drives[j].trajectory = {0, JointPath{JointProfile::quintic, 2, q, q + 1.0, 0, 0}};
  }
  PhaseDynamics dynamics(l.model, setup);
  int samples = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start(l, 1.0, 0.0), 0, 2, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
                       ++samples;
                       for (double x : s.state.q) EXPECT_TRUE(std::isfinite(x));
                       for (double x : s.state.v) EXPECT_TRUE(std::isfinite(x));
                       for (double x : s.motor) EXPECT_TRUE(std::isfinite(x));
                     }});
  EXPECT_FALSE(o.finished);
  EXPECT_NE(o.failure.find("t = "), std::string::npos) << o.failure;
  EXPECT_NE(o.failure.find("loop"), std::string::npos) << o.failure;
  EXPECT_LT(o.end_time, 2);
  for (double x : o.end_state.q) EXPECT_TRUE(std::isfinite(x));
  std::printf("[ measured ] %d samples; %s\n", samples, o.failure.c_str());
}

// Two motors with prescribed constant rates that contradict the loop: rejected at the start with the row. Rates in the
// ratio given by the linkage are accepted.
TEST(ClosedPhase, ContradictoryRatesRejectedAtStart) {
  const Linkage l = linkage();
  const State from = start(l, 1.0, 0.5);
  for (const double factor : {1.0, 1.5}) {
    PhaseSetup setup = closed(l);
    for (std::size_t j = 0; j < setup.drives.size(); ++j) {
      const Body& body = l.model.bodies()[l.model.joints()[j]];
      if (body.description.name == "coupler") continue;
      const double rate = from.v[body.v] * (body.description.name == "rocker" ? factor : 1);
      setup.drives[j].control = JointControl::prescribed;
      setup.drives[j].trajectory = {
          0, JointPath{JointProfile::quintic, 2, from.q[body.q], from.q[body.q] + 2 * rate, rate, rate}};
    }
    PhaseDynamics dynamics(l.model, setup);
    const PhaseOutcome o = simulate_phase(dynamics, {from, 0, 1e-12, 1}, {}, {.observe = [](const PhaseSample&) {}});
    EXPECT_FALSE(o.finished);
    const std::string wrong = "joints that move as prescribed contradict the closed loops at t = 0 s: pin, along";
    EXPECT_EQ(o.failure.starts_with(wrong), factor != 1) << o.failure;
    std::printf("[ measured ] %s\n", o.failure.c_str());
  }
}

// A nearly closed initial state is projected onto the closures. Otherwise it is rejected with the remaining gap.
TEST(ClosedPhase, RejectsOpenStart) {
  const Linkage l = linkage();
  State near = start(l, 1.0, 1.0);
  near.q[coordinate(l, "rocker")] += 1e-3;
  PhaseDynamics dynamics(l.model, closed(l));
  const PhaseOutcome o =
      simulate_phase(dynamics, {near, 0, 1, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                       EXPECT_LT(closure_defect(l.closures[0], forward_kinematics(l.model, s.state)).position, 1e-14);
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(o.loops.unprojected.position, 5e-4);
  EXPECT_GT(o.loops.correction_total, o.loops.integration_error);
  // Links that are too short to close the loop.
  Linkage apart = linkage();
  apart.closures[0].X_BD.p = {-9, 0, 0};
  PhaseDynamics never(apart.model, closed(apart));
  const PhaseOutcome n = simulate_phase(never, {start(l, 1.0, 1.0), 0, 1, 0.1});
  EXPECT_FALSE(n.finished);
  EXPECT_NE(n.failure.find("the loops cannot be closed at t = 0"), std::string::npos) << n.failure;
  EXPECT_NE(n.failure.find(" m and "), std::string::npos) << n.failure;
}

// A crank that a stiff drive with strong damping (10 1/s in all) moves by 0.3 rad: implicit steps, projected onto the
// loop, agree with explicit ones.
TEST(ClosedLoops, ImplicitStepsKeepLoopsClosed) {
  const Linkage l = linkage();
  const State from = start(l, 1.0, 0);
  State ends[2];
  int place = 0;
  for (const IntegrationSetup::Method method :
       {IntegrationSetup::Method::adaptive_8, IntegrationSetup::Method::radau_9}) {
    PhaseSetup setup = closed(l);
    setup.drives[0] = {JointControl::pd, JointTrajectory::at_rest(1.3), 2e4, 2e3};
    PhaseDynamics dynamics(l.model, setup);
    IntegrationSetup integration;
    integration.method = method;
    double defect = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {from, 0, 2, 0.05}, integration, {.observe = [&](const PhaseSample& s) {
                         defect = std::max(defect, angle_between(s.state.q[coordinate(l, "rocker")],
                                                                 shape(s.state.q[coordinate(l, "crank")]).rocker));
                       }});
    ASSERT_TRUE(o.finished) << o.failure;
    std::printf("[ measured ] steps %ld, implicit %ld, evaluations %ld, defect %.2g rad, corrections %.2g of %.2g\n",
                o.steps, o.implicit_steps, o.rhs_evaluations, defect, o.loops.correction_total,
                o.loops.integration_error);
    EXPECT_LT(defect, 1e-12);
    EXPECT_LT(o.loops.correction_total, o.loops.integration_error);
    EXPECT_EQ(o.implicit_steps > 0, place == 1);
    ends[place++] = o.end_state;
  }
  EXPECT_LT(difference(ends[0], ends[1]), 1e-10);
}

}  // namespace closed_loops_test
}  // namespace grapnel::testing
