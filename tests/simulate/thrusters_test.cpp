/// Thrusters: exact edges, propellant, deadband limit cycles, pulse widths, dumping of the wheels' momentum; wheels'
/// speeds in the null space; feedforward of the arms' reaction.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "grapnel/simulate/thruster_bank.hpp"
#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace thrusters_test {

constexpr double kLever = 0.5, kForce = 2, kInertia = 8;

// Couples about each axis, one way and the other: 12 thrusters, each torque kLever * kForce about its axis.
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

// Without drift and disturbance a thruster fires for its least time whenever the deadband's edge is met: rates w and
// D - w take turns, D = T t_min / J, and the period is 2 t_min + 2 (phi_1 + phi_2) ... with the angles at which each
// way meets its edge.
TEST(Thrusters, LimitCycleOfADeadbandHasItsPeriod) {
  constexpr double kp = 20, kd = 40, t_min = 0.05, T = 2 * kLever * kForce, D = T * t_min / kInertia;
  constexpr double w = 0.4 * D;
  const ThrusterModulation schmitt{ThrusterModulation::Kind::schmitt, 0.6, 0.5};
  Case c = make_case(couples(t_min), kp, kd, schmitt);
  // Both thrusters of a couple go on where the torque asked for is level_on of what they give at full force.
  const double on = schmitt.level_on * T;
  const auto edge = [&](double rate) { return (on - kd * rate) / kp; };  // of the angle, going up
  PhaseDynamics dynamics(c.model, c.setup);
  std::vector<double> ons;
  long firings = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, turning_about_z(c.model, 0, w), 0, 300, 0.01, {}, [&](const PhaseSample& s) {
        long now = 0;
        for (std::size_t i = 0; i < c.bank->size(); ++i) now += c.bank->use(i).firings;
        if (now > firings) ons.push_back(s.time);
        firings = now;
      });
  ASSERT_TRUE(o.finished) << o.failure;
  // Upper edge at rate w, then -(D - w) down to the lower edge, then w again. During a pulse the angle moves on.
  const double up = edge(w), down = edge(D - w);
  const double after_up = up + w * t_min - 0.5 * D * t_min, after_down = -down - (D - w) * t_min + 0.5 * D * t_min;
  const double period = 2 * t_min + (after_up + down) / (D - w) + (up - after_down) / w;
  ASSERT_GT(ons.size(), 6u);
  EXPECT_NEAR(ons[4] - ons[0], 2 * period, 0.03);  // samples every 0.01 s
  // In all: as many pulses as fit, each of two thrusters for the least time, to rounding.
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

// Under a constant torque momentum is balanced by pulses from one side: one in T_d P = T t_min.
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
  const PhaseOutcome o =
      simulate_phase(dynamics, turning_about_z(c.model, 0, 0), 0, 200, 0.005, {}, [&](const PhaseSample&) {
        long now = 0;
        for (std::size_t i = 0; i < c.bank->size(); ++i) now += c.bank->use(i).firings;
        if (now > firings) ons.push_back(c.bank->time());
        firings = now;
      });
  ASSERT_TRUE(o.finished) << o.failure;
  ASSERT_GT(ons.size(), 10u);
  for (std::size_t k = 5; k + 1 < ons.size(); ++k) EXPECT_NEAR(ons[k + 1] - ons[k], T * t_min / disturbance, 0.011);
}

// Sampled pulses: what is asked for is given on the average, edges are exact, and momentum is that of the forces.
TEST(Thrusters, PulsesGiveWhatIsAskedForAndTheirEdgesAreExact) {
  for (const double delay : {0.0, 0.03}) {
    Case c = make_case(couples(), 1.5, 6, {});
    c.setup.clock = std::make_shared<ControlClock>(ControlTiming{0.1, delay}, 0);
    PhaseDynamics dynamics(c.model, c.setup);
    const double w0 = 0.05;
    const PhaseOutcome o = simulate_phase(dynamics, turning_about_z(c.model, 0.2, w0), 0, 20, 0.5, {});
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
  const PhaseOutcome o = simulate_phase(dynamics, turning_about_z(c.model, 0, 0.08), 0, 10.2, 0.5, {});
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

TEST(Wheels, SpeedsGoWhereTheyAreWantedWithoutTorqueOnTheBase) {
  WheeledCase w = with_pyramid(1, 400);
  constexpr double rate = 0.2;
  w.setup.actuators.wheel_speed_rate = rate;
  State start = zero_state(w.model);
  const double bias[4] = {60, -60, 60, -60};  // no momentum together
  for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = bias[i];
  EXPECT_LT(norm(momentum_of(w, start)), 1e-14);
  PhaseDynamics dynamics(w.model, w.setup);
  const PhaseOutcome o = simulate_phase(dynamics, start, 0, 20, 0.5, {}, [&](const PhaseSample& s) {
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(s.state.v[w.wheels[i].velocity], bias[i] * std::exp(-rate * s.time), 1e-8);
    EXPECT_LT(norm(s.dynamics->control_torque()), 1e-14);
  });
  ASSERT_TRUE(o.finished) << o.failure;
  const int v = w.model.bodies()[w.setup.attitude->root].v;
  for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(o.end_state.v[v + k]), 1e-14);
}

TEST(Thrusters, DumpTheWheelsMomentumWhileTheBaseStays) {
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
  const PhaseOutcome o = simulate_phase(dynamics, start, 0, 90, 0.5, {}, [&](const PhaseSample& s) {
    const double* q = s.state.q.data() + base.q + 3;
    angle = std::max(angle, 2 * std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]));
  });
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_LT(norm(momentum_of(w, o.end_state)), 0.5);
  // Pulses stand at the beginning of a period: rates are sampled when they are lowest, by half a pulse, 1.25e-3 rad/s,
  // and the attitude makes up for it by k_d/k_p times that.
  EXPECT_LT(angle, 3.2e-3);  // measured 2.91e-3
  EXPECT_EQ(w.bank->dumped().begun, 1);
  EXPECT_FALSE(w.bank->dumped().active);
  // What went out is what came in through the forces, to rounding.
  const Totals at_start = totals(w.model, start), at_end = totals(w.model, o.end_state);
  EXPECT_LT(norm(at_end.momentum.angular - at_start.momentum.angular - o.integrals.external_impulse.angular), 1e-11);
  EXPECT_GT(norm(o.integrals.external_impulse.angular), 3);
}

// Tachometers that read the double.
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

// Sampled, the null-space torques are those of the rates that were read at the tick, held for a period and a delay: of
// rates that are read twice too large W_k+1 = (1 - 2 r T) W_k.
TEST(Wheels, SpeedsAreSampledAndReadAsTheTorqueIs) {
  for (const bool doubled : {false, true}) {
    WheeledCase w = with_pyramid(1, 400);
    constexpr double rate = 0.2, period = 0.5;
    w.setup.actuators.wheel_speed_rate = rate;
    w.setup.clock = std::make_shared<ControlClock>(ControlTiming{period, 0}, 4);
    if (doubled) w.setup.sensors = std::make_shared<Doubling>(w.wheels);
    State start = zero_state(w.model);
    const double bias[4] = {60, -60, 60, -60};
    for (int i = 0; i < 4; ++i) start.v[w.wheels[i].velocity] = bias[i];
    PhaseDynamics dynamics(w.model, w.setup);
    const PhaseOutcome o = simulate_phase(dynamics, start, 0, 10, 0, {});
    ASSERT_TRUE(o.finished) << o.failure;
    const double left = std::pow(1 - (doubled ? 2 : 1) * rate * period, 20);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(o.end_state.v[w.wheels[i].velocity], bias[i] * left, 1e-11);
  }
}

// Dumping begins by the momentum that was read at the tick.
TEST(Thrusters, DumpWhatTheWheelsAreReadToHold) {
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
    const PhaseOutcome o = simulate_phase(dynamics, start, 0, 1, 0, {});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_EQ(w.bank->dumped().begun, doubled ? 1 : 0);
    if (doubled) EXPECT_NEAR(w.bank->dumped().first_begin, 0.05, 1e-12);
    EXPECT_NEAR(w.bank->dumped().largest_momentum, (doubled ? 2 : 1) * held, 1e-12);
  }
}

// --- Feedforward ---

// A base with one long arm that swings: the base turns with it, less with feedback, and not at all with feedforward
// where the joints move as prescribed.
TEST(BaseControl, FeedforwardKeepsTheBaseStillWhileArmsMove) {
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
    const PhaseOutcome o = simulate_phase(dynamics, zero_state(model), 0, 15, 0.1, {}, [&](const PhaseSample& s) {
      const double* p = s.state.q.data() + q;
      largest = std::max(largest, 2 * std::sqrt(p[1] * p[1] + p[2] * p[2] + p[3] * p[3]));
    });
    EXPECT_TRUE(o.finished) << o.failure;
    return largest;
  };
  const double without = largest_turn(false, JointControl::prescribed);
  EXPECT_GT(without, 0.05);
  EXPECT_LT(largest_turn(true, JointControl::prescribed), 1e-10);
  const double tracked = largest_turn(false, JointControl::pd), ahead = largest_turn(true, JointControl::pd);
  EXPECT_LT(ahead, 0.25 * tracked);  // the joint lags behind what the law knows
}

// The rotor of a geared motor has a spin momentum, about an axis that need not be the joint's: the base gives that, too.
TEST(BaseControl, FeedforwardKnowsTheSpinOfRotors) {
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
  // Beside the joint's axis, in a link that turns: both terms of (19.8).
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
  const PhaseOutcome o = simulate_phase(dynamics, zero_state(model), 0, 15, 0.1, {}, [&](const PhaseSample& s) {
    for (int k = 0; k < 3; ++k) fastest = std::max(fastest, std::abs(s.state.v[v + k]));
    largest_torque = std::max(largest_torque, norm(s.dynamics->control_torque()));
  });
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(largest_torque, 0.1);
  EXPECT_LT(fastest, 1e-12);
}

// --- Misuse ---

TEST(Thrusters, SayWhatTheyNeed) {
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
  EXPECT_THROW(simulate_phase(dynamics, zero_state(back.model), 1, 0, 0, {}), std::logic_error);
}

}  // namespace thrusters_test
}  // namespace grapnel::testing
