/// Thrusters: exact edges, propellant, deadband limit cycles, pulse widths, dumping of the wheels' momentum; wheels'
/// speeds in the null space; feedforward of the arms' reaction.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/simulate/thruster_bank.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace thrusters_test {

constexpr double kLever = 0.5, kForce = 2, kInertia = 8;

// Couples about each axis in both directions: 12 thrusters, each with the torque kLever * kForce about its axis.
std::vector<Thruster> couples(double min_on_time = 0, double rise = 0, double fall = 0) {
  std::vector<Thruster> thrusters;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      for (const double sense : {1.0, -1.0}) {
        Thruster t;
        t.position[(axis + 1) % 3] = side * kLever;
        t.direction = Vector3d::zero();
        t.direction[(axis + 2) % 3] = side * sense;
        t.force = kForce, t.specific_impulse = 220, t.min_on_time = min_on_time;
        t.rise = rise, t.fall = fall;
        thrusters.push_back(t);
      }
    }
  }
  return thrusters;
}

struct Case {
  Model model = one_body(Symmetric3d::diagonal(kInertia, kInertia, kInertia));
  std::shared_ptr<ThrusterBank> bank;
  PhaseSetup setup;
};

Case make_case(std::vector<Thruster> thrusters, double kp, double kd, ThrusterModulation modulation) {
  Case c;
  c.bank = std::make_shared<ThrusterBank>(std::move(thrusters), Vector3d{0, 0, 0});
  c.setup.attitude.emplace();
  c.setup.attitude->root = 0;
  c.setup.attitude->kp = {kp, kp, kp}, c.setup.attitude->kd = {kd, kd, kd};
  c.setup.actuators.thrusters = c.bank;
  c.setup.actuators.modulation = modulation;
  return c;
}

State turning_about_z(const Model& model, double angle, double rate) {
  State s = zero_state(model);
  set_root_pose(model, 0, Posed{rotation_about({0, 0, 1}, angle), {0, 0, 0}}, s);
  s.v[2] = rate;
  return s;
}

double used_propellant(const ThrusterBank& bank) {
  double used = 0;
  for (std::size_t i = 0; i < bank.size(); ++i) used += bank.use(i).on_time * mass_flow(bank.thrusters()[i]);
  return used;
}

// Without disturbance a thruster fires for its minimum on-time at each edge of the deadband: the rates w and D - w
// alternate, D = T t_min / J. The period is 2 t_min plus the drift times between the edges.
TEST(Thrusters, LimitCycleOfADeadbandHasItsPeriod) {
  constexpr double kp = 20, kd = 40, t_min = 0.05, T = 2 * kLever * kForce, D = T * t_min / kInertia;
  constexpr double w = 0.4 * D;
  const ThrusterModulation schmitt{ThrusterModulation::Kind::schmitt, 0.6, 0.5};
  Case c = make_case(couples(t_min), kp, kd, schmitt);
  // Both thrusters of a couple switch on where the commanded torque is level_on of their full torque.
  const double on = schmitt.level_on * T;
  const auto edge = [&](double rate) { return (on - kd * rate) / kp; };  // of the angle, going up
  PhaseDynamics dynamics(c.model, c.setup);
  std::vector<double> ons;
  long firings = 0;
  const PhaseOutcome o = simulate_phase(dynamics, {turning_about_z(c.model, 0, w), 0, 300, 0.01}, {},
                                        {.observe = [&](const PhaseSample& s) {
                                          long now = 0;
                                          for (std::size_t i = 0; i < c.bank->size(); ++i)
                                            now += c.bank->use(i).firings;
                                          if (now > firings) ons.push_back(s.time);
                                          firings = now;
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  // Upper edge at rate w, then -(D - w) down to the lower edge, then w again. During a pulse the angle moves on.
  const double up = edge(w), down = edge(D - w);
  const double after_up = up + w * t_min - 0.5 * D * t_min, after_down = -down - (D - w) * t_min + 0.5 * D * t_min;
  const double period = 2 * t_min + (after_up + down) / (D - w) + (up - after_down) / w;
  ASSERT_GT(ons.size(), 6u);
  EXPECT_NEAR(ons[4] - ons[0], 2 * period, 0.03);  // samples every 0.01 s
  // Total: each pulse fires two thrusters for the minimum on-time, up to rounding.
  double on_time = 0, impulse = 0;
  for (std::size_t i = 0; i < c.bank->size(); ++i) on_time += c.bank->use(i).on_time, impulse += c.bank->use(i).impulse;
  const double first = up / w;
  const long expected = 1 + static_cast<long>((300 - first) / period) +
                        static_cast<long>((300 - first + period - t_min - (after_up + down) / (D - w)) / period);
  EXPECT_EQ(firings, 2 * expected);
  EXPECT_NEAR(on_time, static_cast<double>(firings) * t_min, 1e-11);
  EXPECT_NEAR(impulse, on_time * kForce, 1e-10);
  EXPECT_NEAR(c.bank->propellant(c.bank->time()), used_propellant(*c.bank), 1e-15);
}

// One-sided pulses balance the momentum of a constant torque T_d: one pulse per period P with T_d P = T t_min.
TEST(Thrusters, LimitCycleUnderAConstantTorqueBalancesIt) {
  constexpr double t_min = 0.04, T = 2 * kLever * kForce, disturbance = 0.01;
  Case c = make_case(couples(t_min), 20, 60, {ThrusterModulation::Kind::schmitt, 0.6, 0.5});
  ExternalLoad load;
  load.body = 0;
  load.amplitude.angular = {0, 0, disturbance};
  c.setup.loads.push_back(load);
  PhaseDynamics dynamics(c.model, c.setup);
  std::vector<double> ons;
  long firings = 0;
  const PhaseOutcome o = simulate_phase(dynamics, {turning_about_z(c.model, 0, 0), 0, 200, 0.005}, {},
                                        {.observe = [&](const PhaseSample&) {
                                          long now = 0;
                                          for (std::size_t i = 0; i < c.bank->size(); ++i)
                                            now += c.bank->use(i).firings;
                                          if (now > firings) ons.push_back(c.bank->time());
                                          firings = now;
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  ASSERT_GT(ons.size(), 10u);
  for (std::size_t k = 5; k + 1 < ons.size(); ++k) EXPECT_NEAR(ons[k + 1] - ons[k], T * t_min / disturbance, 0.011);
}

// Sampled pulses: the mean torque equals the command, edges are exact, and the momentum equals the impulse of the
// forces.
TEST(Thrusters, PulsesMatchCommandWithExactEdges) {
  for (const double delay : {0.0, 0.03}) {
    Case c = make_case(couples(), 1.5, 6, {});
    c.setup.clock = std::make_shared<ControlClock>(ControlTiming{0.1, delay}, 0);
    PhaseDynamics dynamics(c.model, c.setup);
    const double w0 = 0.05;
    const PhaseOutcome o = simulate_phase(dynamics, {turning_about_z(c.model, 0.2, w0), 0, 20, 0.5});
    ASSERT_TRUE(o.finished) << o.failure;
    double about_z = 0;
    for (std::size_t i = 0; i < c.bank->size(); ++i)
      about_z += c.bank->allocation().torque(i)[2] * c.bank->use(i).on_time;
    EXPECT_NEAR(kInertia * (o.end_state.v[2] - w0), about_z, 2e-14);
    EXPECT_NEAR(o.integrals.external_impulse.angular[2], about_z, 2e-14);
    EXPECT_LT(norm(o.integrals.external_impulse.linear), 1e-14);
    EXPECT_LT(std::abs(o.end_state.v[2]), 2e-3);
    EXPECT_GT(c.bank->use(8).firings + c.bank->use(9).firings, 10);
    const double energy = 0.5 * kInertia * (o.end_state.v[2] * o.end_state.v[2] - w0 * w0);
    EXPECT_NEAR(o.integrals.external_work, energy, 1e-13);
  }
}

// Ramps: the impulse of a pulse is F (on + (fall - rise) / 2), and the momentum follows.
TEST(Thrusters, RampsAreExact) {
  constexpr double rise = 0.013, fall = 0.021;
  Case c = make_case(couples(0.05, rise, fall), 1, 5, {});
  c.setup.clock = std::make_shared<ControlClock>(ControlTiming{0.25, 0}, 0);
  PhaseDynamics dynamics(c.model, c.setup);
  const PhaseOutcome o = simulate_phase(dynamics, {turning_about_z(c.model, 0, 0.08), 0, 10.2, 0.5});
  ASSERT_TRUE(o.finished) << o.failure;
  double about_z = 0;
  for (std::size_t i = 0; i < c.bank->size(); ++i) {
    const ThrusterBank::Use use = c.bank->use(i);
    about_z += c.bank->allocation().torque(i)[2] * use.impulse / kForce;
    EXPECT_NEAR(use.impulse, kForce * (use.on_time + static_cast<double>(use.firings) * 0.5 * (fall - rise)), 1e-13);
  }
  EXPECT_NEAR(kInertia * (o.end_state.v[2] - 0.08), about_z, 2e-14);
  EXPECT_GT(std::abs(about_z), 0.3);
}

// --- Valves, one by one: thrusters 0 and 3 give torque about +x, 4 and 7 about +y ---

ThrusterBank begun_bank(double min_on_time = 0, double rise = 0, double fall = 0) {
  ThrusterBank bank(couples(min_on_time, rise, fall), Vector3d{0, 0, 0});
  bank.begin(0, 1e-12);
  return bank;
}

TEST(ThrusterBank, LongPulsesAreScaledTogether) {
  ThrusterBank bank = begun_bank();
  // A couple gives 2 N m: 2 s and 0.5 s of a period of 1 s.
  const Vector3d mean = bank.pulse({4, 1, 0}, 1, {});
  EXPECT_LT(norm(mean - Vector3d{2, 0.5, 0}), 1e-14);
  bank.advance(0.25, 1e-12);
  bank.advance(1, 1e-12);
  double x = 0, y = 0;
  for (std::size_t i = 0; i < 4; ++i) x += bank.use(i).on_time, y += bank.use(4 + i).on_time;
  EXPECT_NEAR(x, 2 * 1.0, 1e-14);
  EXPECT_NEAR(y, 2 * 0.25, 1e-14);
}

TEST(ThrusterBank, ShortPulsesHaveHysteresis) {
  ThrusterBank bank = begun_bank(0.1);
  const ThrusterModulation pulses{ThrusterModulation::Kind::pulse_width, 0.75, 0.25};
  // Commanded shares of the minimum on-time, and whether the thruster fires.
  const std::pair<double, bool> cases[] = {{0.5, false}, {0.74, false}, {0.76, true}, {0.5, true},
                                           {0.26, true}, {0.24, false}, {0.5, false}};
  double t = 0;
  for (const auto& [share, fires] : cases) {
    const Vector3d mean = bank.pulse({2 * 0.1 * share, 0, 0}, 1, pulses);
    EXPECT_NEAR(mean[0], fires ? 2 * 0.1 : 0, 1e-15) << share;
    bank.advance(t + 0.1, 1e-12);
    bank.advance(t += 1, 1e-12);
  }
}

TEST(ThrusterBank, ConsecutivePulsesCountFromTheirOwnStart) {
  ThrusterBank bank = begun_bank();
  bank.pulse({2, 0, 0}, 1, {});
  bank.advance(1, 1e-12);
  bank.pulse({1, 0, 0}, 1, {});
  EXPECT_NEAR(bank.next_edge(1, 10, 1e-12), 1.5, 1e-15);
  bank.advance(1.5, 1e-12);
  bank.advance(2, 1e-12);
  double on = 0;
  long firings = 0;
  for (std::size_t i = 0; i < 4; ++i) on += bank.use(i).on_time, firings += bank.use(i).firings;
  EXPECT_NEAR(on, 2 * 1.5, 1e-14);
  EXPECT_EQ(firings, 2);  // once per thruster
}

TEST(ThrusterBank, PartialRampEndsEarlier) {
  ThrusterBank bank = begun_bank(0, 1, 1);
  bank.open(0);
  bank.advance(0.4, 1e-12);
  bank.close(0);
  EXPECT_NEAR(bank.next_edge(0.4, 10, 1e-12), 0.8, 1e-15);
  bank.advance(0.6, 1e-12);
  EXPECT_NEAR(bank.level(0, 0.6), 0.2, 1e-15);
  bank.open(0);
  EXPECT_NEAR(bank.next_edge(0.6, 10, 1e-12), 0.6 + 0.8, 1e-15);
}

TEST(ThrusterBank, ValvesCloseBetweenCalls) {
  ThrusterBank bank = begun_bank();
  bank.open(0);
  bank.mean_torque = {1, 0, 0};
  bank.advance(1, 1e-12);
  bank.begin(1, 1e-12);  // the next segment, without a gap
  EXPECT_TRUE(bank.is_open(0));
  bank.begin(1.5, 1e-12);
  EXPECT_FALSE(bank.is_open(0));
  EXPECT_EQ(bank.level(0, 1.5), 0);
  EXPECT_EQ(norm(bank.mean_torque), 0);
  EXPECT_NEAR(bank.use(0).on_time, 1, 1e-15);
}

TEST(ThrusterBank, CountsDumpingTime) {
  ThrusterBank bank = begun_bank();
  const MomentumDumping dumping{4, 1, 0.2};
  EXPECT_TRUE(bank.dumps(5, dumping));
  bank.advance(3, 1e-12);
  EXPECT_TRUE(bank.dumps(2, dumping));
  EXPECT_FALSE(bank.dumps(0.5, dumping));
  bank.advance(4, 1e-12);
  EXPECT_FALSE(bank.dumps(2, dumping));
  EXPECT_NEAR(bank.dumped().time, 3, 1e-15);
  EXPECT_NEAR(bank.dumped().last_end, 3, 1e-15);
}

// Rate feedback only: a thruster switches on above level_on, gives a constant torque, and switches off exactly at
// level_off.
TEST(Thrusters, SwitchExactlyAtLevel) {
  constexpr double kd = 10, T = 2 * kLever * kForce, w0 = 0.18;
  const ThrusterModulation schmitt{ThrusterModulation::Kind::schmitt, 0.8, 0.3};
  Case c = make_case(couples(), 0, kd, schmitt);
  PhaseDynamics dynamics(c.model, c.setup);
  const PhaseOutcome o = simulate_phase(dynamics, {turning_about_z(c.model, 0, w0), 0, 5});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(o.end_state.v[2], schmitt.level_off * T / kd, 1e-12);
  EXPECT_NEAR(c.bank->use(8).on_time + c.bank->use(9).on_time, kInertia * (w0 - o.end_state.v[2]) / T, 1e-11);
}

// The controller receives the actual other forces: they give the simulated accelerations. The case includes thrusters,
// a base whose centre of mass is not its origin, and another joint at its effort limit.
struct Listening : Controller {
  void update(const ControlInput& in, ControlCommand&) override { force.assign(in.force.begin(), in.force.end()); }
  std::vector<double> force;
};

TEST(Thrusters, LawsReceiveThrusterForces) {
  BodyDescription base, arm, hand;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 100, base.com = {0.1, -0.2, 0.3}, base.inertia = Symmetric3d::diagonal(20, 25, 30);
  arm.name = arm.joint.name = "arm", arm.parent = "base";
  arm.joint.type = JointType::revolute, arm.joint.axis = {0, 0.6, 0.8};
  arm.X_PF.p = {0.5, 0.2, 0.3};
  arm.mass = 10, arm.com = {1, 0.1, 0}, arm.inertia = Symmetric3d::diagonal(0.5, 3, 3);
  hand = arm;
  hand.name = hand.joint.name = "hand", hand.parent = "arm";
  hand.X_PF.p = {2, 0, 0};
  hand.joint.limits.effort = 1;
  const Model model = ModelBuilder().add(base).add(arm).add(hand).build();
  // One thruster for each torque direction, without couples.
  std::vector<Thruster> thrusters = couples();
  for (const int both : {10, 6, 2}) thrusters.erase(thrusters.begin() + both, thrusters.begin() + both + 2);
  const auto bank = std::make_shared<ThrusterBank>(thrusters, base.com);
  const auto law = std::make_shared<Listening>();
  PhaseSetup setup;
  setup.drives.resize(2);
  const bool arm_first = model.bodies()[model.joints()[0]].description.name == "arm";
  JointDrive &listens = setup.drives[arm_first ? 0 : 1], &holds = setup.drives[arm_first ? 1 : 0];
  listens.control = JointControl::controller;
  holds.control = JointControl::pd, holds.kp = 100, holds.trajectory = JointTrajectory::at_rest(1);
  setup.controller = law;
  setup.attitude.emplace();
  setup.attitude->root = model.body_index("base");
  setup.attitude->kp = {4, 4, 4}, setup.attitude->kd = {20, 20, 20};
  setup.actuators.thrusters = bank;
  setup.actuators.modulation = {ThrusterModulation::Kind::schmitt, 0.6, 0.2};
  PhaseDynamics dynamics(model, setup);
  State start = zero_state(model);
  set_root_pose(model, setup.attitude->root, Posed{rotation_about({0.6, 0, 0.8}, 1.2), {1, 2, 3}}, start);
  const std::vector<double> y = dynamics.initial(start, 0);
  dynamics.begin_control(0, 1);
  dynamics.enter_interval(0, 1);
  dynamics.choose_modes(0, y);
  std::vector<double> dydt(y.size());
  dynamics(0, y, dydt);
  ASSERT_GT(norm(dynamics.control_torque()), 0.1);
  const Eigen::Map<const Eigen::VectorXd> known_force(law->force.data(), model.velocities());
  EXPECT_GT(known_force.segment<3>(model.bodies()[setup.attitude->root].v + 3).norm(), 0.1);
  const Eigen::VectorXd follows = mass_matrix(model, start).ldlt().solve(known_force);
  for (int i = 0; i < model.velocities(); ++i) EXPECT_NEAR(follows[i], dynamics.acceleration()[i], 1e-13) << i;
  // The reported torque is about the base's centre of mass.
  Vector3d torque = Vector3d::zero();
  for (std::size_t i = 0; i < bank->size(); ++i)
    torque += bank->level(i, 0) * cross(thrusters[i].position - base.com, thrusters[i].force * thrusters[i].direction);
  EXPECT_LT(norm(dynamics.control_torque() - torque), 1e-14);
}

// --- With wheels ---

struct WheeledCase : Case {
  std::vector<ReactionWheel> wheels;
};

constexpr double kRotor = 0.05;

WheeledCase with_pyramid(double torque, double rate) {
  const double c = std::cos(0.6), s = std::sin(0.6);
  const std::vector<Vector3d> axes{{c, 0, s}, {0, c, s}, {-c, 0, s}, {0, -c, s}};
  WheeledCase w;
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 60;
  base.inertia = Symmetric3d::diagonal(kInertia, kInertia, kInertia);
  ModelBuilder builder;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    BodyDescription rotor;
    rotor.name = rotor.joint.name = "wheel" + std::to_string(i);
    rotor.parent = "base";
    rotor.joint.type = JointType::revolute, rotor.joint.axis = axes[i];
    rotor.mass = 1e-3;
    const Vector3d& a = axes[i];
    const double h = 0.5 * kRotor;
    rotor.inertia = {h + h * a[0] * a[0], h + h * a[1] * a[1], h + h * a[2] * a[2],
                     h * a[0] * a[1],     h * a[0] * a[2],     h * a[1] * a[2]};
    builder.add(rotor);
  }
  builder.add(base);
  w.model = builder.build();
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const int body = w.model.body_index("wheel" + std::to_string(i));
    const auto& joints = w.model.joints();
    const auto at = std::find(joints.begin(), joints.end(), body);
    w.wheels.push_back(
        {static_cast<int>(at - joints.begin()), w.model.bodies()[body].v, axes[i], torque, rate, kRotor});
  }
  w.setup.wheels = w.wheels;
  w.setup.attitude.emplace();
  w.setup.attitude->root = w.model.body_index("base");
  w.setup.attitude->kp = {4, 4, 4}, w.setup.attitude->kd = {10, 10, 10};
  return w;
}

Vector3d momentum_of(const WheeledCase& w, const State& s) {
  Vector3d h = Vector3d::zero();
  for (const ReactionWheel& wheel : w.wheels) h += kRotor * s.v[wheel.velocity] * wheel.axis;
  return h;
}

TEST(Wheels, NullSpaceControlReachesSpeeds) {
  WheeledCase w = with_pyramid(1, 400);
  constexpr double rate = 0.2;
  w.setup.actuators.wheel_speed_rate = rate;
  State start = zero_state(w.model);
  const double bias[4] = {60, -60, 60, -60};  // zero total momentum
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = bias[i];
  EXPECT_LT(norm(momentum_of(w, start)), 1e-14);
  PhaseDynamics dynamics(w.model, w.setup);
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 20, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                       for (int i = 0; i < 4; ++i)
                         EXPECT_NEAR(s.state.v[w.wheels[i].velocity], bias[i] * std::exp(-rate * s.time), 1e-8);
                       EXPECT_LT(norm(s.dynamics->control_torque()), 1e-14);
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  const int v = w.model.bodies()[w.setup.attitude->root].v;
  for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(o.end_state.v[v + k]), 1e-14);
}

// Wheels with total momentum: null-space control does not reduce it, because that would rotate the base.
TEST(Wheels, NullSpaceControlConservesMomentum) {
  WheeledCase w = with_pyramid(1, 400);
  constexpr double rate = 0.2;
  w.setup.actuators.wheel_speed_rate = rate;
  State start = zero_state(w.model);
  const double rates[4] = {60, -20, 30, 10};
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = rates[i];
  const Vector3d held = momentum_of(w, start);
  ASSERT_GT(norm(held), 1);
  PhaseDynamics dynamics(w.model, w.setup);
  const int v = w.model.bodies()[w.setup.attitude->root].v;
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 20, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                                          for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(s.state.v[v + k]), 1e-13);
                                          EXPECT_LT(norm(momentum_of(w, s.state) - held), 1e-11);
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  // The null space of the pyramid is (1, -1, 1, -1)/2.
  const auto apart = [&](const State& s) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += (i % 2 == 0 ? 0.5 : -0.5) * s.v[w.wheels[i].velocity];
    return sum;
  };
  EXPECT_NEAR(apart(o.end_state), apart(start) * std::exp(-rate * 20), 1e-9);
}

// Null-space control uses only the motor torque that attitude control leaves.
TEST(Wheels, NullSpaceControlUsesRemainingTorque) {
  constexpr double most = 0.5;
  WheeledCase w = with_pyramid(most, 400);
  w.setup.actuators.wheel_speed_rate = 2;
  State start = zero_state(w.model);
  const int v = w.model.bodies()[w.setup.attitude->root].v;
  start.v[v] = 0.05, start.v[v + 1] = -0.02, start.v[v + 2] = 0.03;
  const double bias[4] = {60, -60, 60, -60};
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = bias[i];
  PhaseDynamics dynamics(w.model, w.setup);
  double largest = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 3, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
        for (const ReactionWheel& wheel : w.wheels) largest = std::max(largest, std::abs(s.motor[wheel.joint]));
        EXPECT_LT(norm(s.dynamics->control_torque() - s.dynamics->base().attitude_torque_in(s.state)), 1e-13);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(largest, most, 1e-14);
}

// At most the remaining momentum is dumped: one sufficiently long period dumps all of it.
TEST(Thrusters, DumpAtMostRemainingMomentum) {
  WheeledCase w = with_pyramid(20, 400);
  w.bank = std::make_shared<ThrusterBank>(couples(), Vector3d{0, 0, 0});
  w.setup.actuators.thrusters = w.bank;
  w.setup.actuators.dumping = MomentumDumping{0.9, 0.5, 100};
  w.setup.clock = std::make_shared<ControlClock>(ControlTiming{1, 0}, 4);
  State start = zero_state(w.model);
  const double rates[4] = {12, -4, 8, 10};
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = rates[i];
  const Vector3d held = momentum_of(w, start);
  ASSERT_GT(norm(held), 0.9);
  PhaseDynamics dynamics(w.model, w.setup);
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 1});
  ASSERT_TRUE(o.finished) << o.failure;
  double on = 0, expected = 0;
  for (std::size_t i = 0; i < w.bank->size(); ++i) on += w.bank->use(i).on_time;
  for (int k = 0; k < 3; ++k) expected += std::abs(held[k]) / (kLever * kForce);
  EXPECT_NEAR(on, expected, 1e-12);
}

TEST(Thrusters, DumpWheelMomentumWithBaseAtRest) {
  WheeledCase w = with_pyramid(2, 400);
  w.bank = std::make_shared<ThrusterBank>(couples(0.002), Vector3d{0, 0, 0});
  w.setup.actuators.thrusters = w.bank;
  w.setup.actuators.dumping = MomentumDumping{4, 0.5, 0.2};
  w.setup.clock = std::make_shared<ControlClock>(ControlTiming{0.1, 0}, 4);
  State start = zero_state(w.model);
  const double rates[4] = {90, -20, 30, 70};
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = rates[i];
  const Vector3d before = momentum_of(w, start);
  ASSERT_GT(norm(before), 4);
  PhaseDynamics dynamics(w.model, w.setup);
  const Body& base = w.model.bodies()[w.setup.attitude->root];
  double angle = 0;
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 90, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                                          const double* q = s.state.q.data() + base.q + 3;
                                          angle =
                                              std::max(angle, 2 * std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]));
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_LT(norm(momentum_of(w, o.end_state)), 0.5);
  // Pulses are at the beginning of a period, so sampled rates are low by half a pulse, 1.25e-3 rad/s. The attitude
  // compensates with k_d/k_p times that value.
  EXPECT_LT(angle, 3.2e-3);  // measured 2.91e-3
  EXPECT_EQ(w.bank->dumped().begun, 1);
  EXPECT_FALSE(w.bank->dumped().active);
  // The change of momentum equals the external impulse up to rounding.
  const Totals at_start = totals(w.model, start), at_end = totals(w.model, o.end_state);
  EXPECT_LT(norm(at_end.momentum.angular - at_start.momentum.angular - o.integrals.external_impulse.angular), 1e-11);
  EXPECT_GT(norm(o.integrals.external_impulse.angular), 3);
}

// Tachometers that read twice the rate.
class Doubling : public SensorReader {
 public:
  explicit Doubling(std::vector<ReactionWheel> wheels) : wheels_(std::move(wheels)) {}
  bool needs_forces() const override { return false; }
  void read(const PhaseSample&, State& seen) override {
    for (const ReactionWheel& wheel : wheels_) seen.v[wheel.velocity] *= 2;
  }
  const SensorReadings& readings() const override { return readings_; }

 private:
  std::vector<ReactionWheel> wheels_;
  SensorReadings readings_;
};

// Sampled null-space torques follow from the rates measured at the sample and are held for a period. With doubled
// readings W_k+1 = (1 - 2 r T) W_k.
TEST(Wheels, NullSpaceControlIsSampled) {
  for (const bool doubled : {false, true}) {
    WheeledCase w = with_pyramid(2, 400);
    constexpr double rate = 0.2, period = 0.5;
    w.setup.actuators.wheel_speed_rate = rate;
    w.setup.clock = std::make_shared<ControlClock>(ControlTiming{period, 0}, 4);
    if (doubled) w.setup.sensors = std::make_shared<Doubling>(w.wheels);
    State start = zero_state(w.model);
    const double bias[4] = {60, -60, 60, -60};
    for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = bias[i];
    PhaseDynamics dynamics(w.model, w.setup);
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 10});
    ASSERT_TRUE(o.finished) << o.failure;
    const double left = std::pow(1 - (doubled ? 2 : 1) * rate * period, 20);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(o.end_state.v[w.wheels[i].velocity], bias[i] * left, 1e-11);
  }
}

// The momentum measured at the sample starts the dumping.
TEST(Thrusters, DumpMeasuredMomentum) {
  for (const bool doubled : {false, true}) {
    WheeledCase w = with_pyramid(2, 400);
    w.bank = std::make_shared<ThrusterBank>(couples(), Vector3d{0, 0, 0});
    w.setup.actuators.thrusters = w.bank;
    w.setup.actuators.dumping = MomentumDumping{4, 0.5, 0.2};
    w.setup.clock = std::make_shared<ControlClock>(ControlTiming{0.1, 0.05}, 4);
    if (doubled) w.setup.sensors = std::make_shared<Doubling>(w.wheels);
    State start = zero_state(w.model);
    for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = 25;
    const double held = norm(momentum_of(w, start));
    ASSERT_TRUE(held < 4 && 2 * held > 4) << held;
    PhaseDynamics dynamics(w.model, w.setup);
    const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 1});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_EQ(w.bank->dumped().begun, doubled ? 1 : 0);
    if (doubled) {
      EXPECT_NEAR(w.bank->dumped().first_begin, 0.05, 1e-12);
    }
    EXPECT_NEAR(w.bank->dumped().largest_momentum, (doubled ? 2 : 1) * held, 1e-12);
  }
}

// --- Feedforward ---

// A long arm that moves rotates its base. Feedforward prevents the rotation if the joints have prescribed motion, and
// reduces it under PD control.
TEST(BaseControl, FeedforwardHoldsBaseWhileArmsMove) {
  BodyDescription base, arm;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 100, base.inertia = Symmetric3d::diagonal(20, 20, 20);
  arm.name = arm.joint.name = "arm", arm.parent = "base";
  arm.joint.type = JointType::revolute, arm.joint.axis = {0, 0.6, 0.8};
  arm.X_PF.p = {0.5, 0.2, 0.3};
  arm.mass = 10, arm.com = {1, 0.1, 0}, arm.inertia = Symmetric3d::diagonal(0.5, 3, 3);
  const Model model = ModelBuilder().add(base).add(arm).build();
  const auto largest_turn = [&](bool feedforward, JointControl control) {
    PhaseSetup setup;
    JointDrive drive;
    drive.control = control;
    drive.trajectory = {0, JointPath{JointProfile::quintic, 10, 0, 1.5}};
    drive.kp = 400, drive.kd = 200;
    setup.drives = {drive};
    setup.attitude.emplace();
    setup.attitude->root = model.body_index("base");
    setup.attitude->kp = {4, 4, 4}, setup.attitude->kd = {20, 20, 20};
    setup.actuators.feedforward = feedforward;
    PhaseDynamics dynamics(model, setup);
    const int q = model.bodies()[setup.attitude->root].q + 3;
    double largest = 0;
    const PhaseOutcome o =
        simulate_phase(dynamics, {zero_state(model), 0, 15, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                         const double* p = s.state.q.data() + q;
                         largest = std::max(largest, 2 * std::sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]));
                       }});
    EXPECT_TRUE(o.finished) << o.failure;
    return largest;
  };
  const double without = largest_turn(false, JointControl::prescribed);
  EXPECT_GT(without, 0.05);
  EXPECT_LT(largest_turn(true, JointControl::prescribed), 1e-10);
  const double tracked = largest_turn(false, JointControl::pd), ahead = largest_turn(true, JointControl::pd);
  EXPECT_LT(ahead, 0.25 * tracked);  // the joint lags behind its reference
}

// The rotor of a geared motor has spin momentum about an axis that may differ from the joint axis. Feedforward includes
// it.
TEST(BaseControl, FeedforwardIncludesRotorSpin) {
  BodyDescription base, arm, hand;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 100, base.inertia = Symmetric3d::diagonal(20, 25, 30);
  arm.name = arm.joint.name = "arm", arm.parent = "base";
  arm.joint.type = JointType::revolute, arm.joint.axis = {0, 0.6, 0.8};
  arm.X_PF.p = {0.5, 0.2, 0.3};
  arm.mass = 10, arm.com = {1, 0.1, 0}, arm.inertia = Symmetric3d::diagonal(0.5, 3, 3);
  hand.name = hand.joint.name = "hand", hand.parent = "arm";
  hand.joint.type = JointType::revolute, hand.joint.axis = {1, 0, 0};
  hand.X_PF.p = {2, 0, 0};
  hand.mass = 3, hand.com = {0.2, 0, 0.1}, hand.inertia = Symmetric3d::diagonal(0.1, 0.2, 0.2);
  // Rotor axis different from the joint axis, in a rotating link: both terms of (19.8).
  hand.joint.rotor_inertia = 2e-2, hand.joint.gear_ratio = 100, hand.joint.rotor_axis = Vector3d{0, 0.8, 0.6};
  const Model model = ModelBuilder().add(base).add(arm).add(hand).build();
  PhaseSetup setup;
  for (const double to : {1.5, -2.0}) {
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory = {0, JointPath{JointProfile::quintic, 10, 0, to}};
    setup.drives.push_back(drive);
  }
  setup.attitude.emplace();
  setup.attitude->root = model.body_index("base");
  setup.attitude->kp = {4, 4, 4}, setup.attitude->kd = {20, 20, 20};
  setup.actuators.feedforward = true;
  PhaseDynamics dynamics(model, setup);
  const int v = model.bodies()[setup.attitude->root].v;
  double fastest = 0, largest_torque = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {zero_state(model), 0, 15, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                       for (int k = 0; k < 3; ++k) fastest = std::max(fastest, std::abs(s.state.v[v + k]));
                       largest_torque = std::max(largest_torque, norm(s.dynamics->control_torque()));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(largest_torque, 0.1);
  EXPECT_LT(fastest, 1e-12);
}

// For a rotating base with a fixed arm the feedforward torque is zero. The torque limit applies to the sum.
TEST(BaseControl, FeedforwardFromJointMotionWithinLimit) {
  BodyDescription base, arm;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 100, base.inertia = Symmetric3d::diagonal(20, 25, 30);
  arm.name = arm.joint.name = "arm", arm.parent = "base";
  arm.joint.type = JointType::revolute, arm.joint.axis = {0, 0.6, 0.8};
  arm.X_PF.p = {0.5, 0.2, 0.3};
  arm.mass = 10, arm.com = {1, 0.1, 0}, arm.inertia = Symmetric3d::diagonal(0.5, 3, 3);
  const Model model = ModelBuilder().add(base).add(arm).build();
  const int v = model.bodies()[model.body_index("base")].v;
  const auto run = [&](bool feedforward, double to, double limit) {
    PhaseSetup setup;
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory = {0, JointPath{JointProfile::quintic, 10, 0, to}};
    setup.drives = {drive};
    setup.attitude.emplace();
    setup.attitude->root = model.body_index("base");
    setup.attitude->kp = {4, 4, 4}, setup.attitude->kd = {20, 20, 20};
    setup.attitude->limit = {limit, limit, limit};
    setup.actuators.feedforward = feedforward;
    PhaseDynamics dynamics(model, setup);
    State start = zero_state(model);
    start.v[v] = 0.2, start.v[v + 1] = -0.3, start.v[v + 2] = 0.1;
    double largest = 0;
    PhaseOutcome o = simulate_phase(dynamics, {start, 0, 10, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                                      for (int k = 0; k < 3; ++k)
                                        largest = std::max(largest, std::abs(s.dynamics->control_torque()[k]));
                                    }});
    EXPECT_TRUE(o.finished) << o.failure;
    return std::pair{o.end_state, largest};
  };
  const double none = std::numeric_limits<double>::infinity();
  EXPECT_LT(difference(run(true, 0, none).first, run(false, 0, none).first), 1e-12);
  EXPECT_GT(difference(run(true, 3, none).first, run(false, 3, none).first), 1e-3);
  EXPECT_EQ(run(true, 3, 0.5).second, 0.5);
}

// --- Misuse ---

TEST(Thrusters, ReportRequirements) {
  Case c = make_case(couples(), 1, 1, {});
  EXPECT_THROW(PhaseDynamics(c.model, c.setup), std::invalid_argument);  // pulse widths without a clock
  c.setup.actuators.modulation.kind = ThrusterModulation::Kind::schmitt;
  EXPECT_NO_THROW(PhaseDynamics(c.model, c.setup));
  c.setup.actuators.dumping = MomentumDumping{1, 0.5, 0.1};
  EXPECT_THROW(PhaseDynamics(c.model, c.setup), std::invalid_argument);  // no wheels
  std::vector<Thruster> faulty = couples();
  faulty[0].force = 0;
  EXPECT_THROW(ThrusterBank(faulty, Vector3d{0, 0, 0}), std::invalid_argument);
  Case back = make_case(couples(), 1, 1, {ThrusterModulation::Kind::schmitt, 0.6, 0.2});
  PhaseDynamics dynamics(back.model, back.setup);
  EXPECT_THROW(simulate_phase(dynamics, {zero_state(back.model), 1, 0}), std::logic_error);
}

}  // namespace thrusters_test
}  // namespace grapnel::testing
