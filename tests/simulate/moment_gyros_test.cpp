/// Control moment gyros: exact motion of a scissored pair, motors' torques, conservation in three dimensions, steering
/// with and without a singularity, motors with insufficient torque.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "grapnel/simulate/moment_gyros.hpp"
#include "simulate/phase_case.hpp"

namespace grapnel::testing {
namespace moment_gyros_test {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kJ = 0.02, kSpin = 500, kGimbal = 0.03, kBandwidth = 10;  // h = 10 N m s
constexpr double kH = kJ * kSpin;

struct Axes {
  Vector3d gimbal, spin;
};

Symmetric3d about(const Vector3d& a, double J) {
  const double h = 0.5 * J;
  return {h + h * a[0] * a[0], h + h * a[1] * a[1], h + h * a[2] * a[2],
          h * a[0] * a[1],     h * a[0] * a[2],     h * a[1] * a[2]};
}

// A body with gyros; its inertia includes them, at zero gimbal angles.
struct Case {
  Model model;
  std::vector<MomentGyro> gyros;
  int base = 0;
};

Case body_with(const std::vector<Axes>& axes, Symmetric3d inertia, double torque = kNone, double rate = kNone) {
  BodyDescription base;
  base.name = base.joint.name = "base", base.joint.type = JointType::free;
  base.mass = 100;
  ModelBuilder builder;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    BodyDescription gimbal, rotor;
    gimbal.name = gimbal.joint.name = "gimbal" + std::to_string(i);
    rotor.name = rotor.joint.name = "rotor" + std::to_string(i);
    gimbal.parent = "base", rotor.parent = gimbal.name;
    gimbal.joint.type = rotor.joint.type = JointType::revolute;
    gimbal.joint.axis = axes[i].gimbal, rotor.joint.axis = axes[i].spin;
    gimbal.mass = rotor.mass = 1e-4;
    gimbal.inertia = about(axes[i].gimbal, kGimbal - 0.5 * kJ), rotor.inertia = about(axes[i].spin, kJ);
    for (const BodyDescription* part : {&gimbal, &rotor}) {
      for (double Symmetric3d::*entry :
           {&Symmetric3d::xx, &Symmetric3d::yy, &Symmetric3d::zz, &Symmetric3d::xy, &Symmetric3d::xz, &Symmetric3d::yz})
        inertia.*entry -= part->inertia.*entry;
      builder.add(*part);
    }
  }
  base.inertia = inertia;
  builder.add(base);
  Case c{builder.build(), {}, 0};
  c.base = c.model.body_index("base");
  const auto joint = [&](const std::string& name) {
    const auto& joints = c.model.joints();
    return static_cast<int>(std::find(joints.begin(), joints.end(), c.model.body_index(name)) - joints.begin());
  };
  for (std::size_t i = 0; i < axes.size(); ++i) {
    MomentGyro g;
    g.gimbal = joint("gimbal" + std::to_string(i)), g.rotor = joint("rotor" + std::to_string(i));
    const Body &gimbal = c.model.bodies()[c.model.joints()[g.gimbal]],
               &rotor = c.model.bodies()[c.model.joints()[g.rotor]];
    g.gimbal_coordinate = gimbal.q, g.gimbal_velocity = gimbal.v, g.rotor_velocity = rotor.v;
    g.gimbal_axis = axes[i].gimbal, g.spin_axis = axes[i].spin;
    g.inertia = kJ, g.spin_rate = kSpin, g.torque = torque, g.rate = rate, g.bandwidth = kBandwidth;
    c.gyros.push_back(g);
  }
  return c;
}

std::vector<Axes> pyramid() {
  const double c = std::sqrt(2.0 / 3), s = std::sqrt(1.0 / 3);
  return {{{c, 0, s}, {0, 1, 0}}, {{0, c, s}, {-1, 0, 0}}, {{-c, 0, s}, {0, -1, 0}}, {{0, -c, s}, {1, 0, 0}}};
}

State spinning(const Case& c, const std::vector<double>& angles = {}) {
  State state = zero_state(c.model);
  for (std::size_t i = 0; i < c.gyros.size(); ++i) {
    state.v[c.gyros[i].rotor_velocity] = kSpin;
    if (!angles.empty()) state.q[c.gyros[i].gimbal_coordinate] = angles[i];
  }
  return state;
}

Vector3d rate_of(const Case& c, const State& state) {
  const double* v = state.v.data() + c.model.bodies()[c.base].v;
  return {v[0], v[1], v[2]};
}

// Commands a rate for every gimbal from the first sample on.
struct Rates : Controller {
  explicit Rates(std::vector<double> r) : rates(std::move(r)) {}
  void update(const ControlInput&, ControlCommand& command) override { command.actuators.gimbal_rate = rates; }
  std::vector<double> rates;
};

PhaseSetup commanding_rates(const Case& c, const std::vector<double>& rates) {
  PhaseSetup setup;
  setup.gyros = c.gyros;
  setup.controller = std::make_shared<Rates>(rates);
  setup.commanded_root = c.base;
  setup.actuators.one_by_one = true;
  setup.clock = std::make_shared<ControlClock>(ControlTiming{0.5, 0}, c.model.joints().size());
  return setup;
}

PhaseSetup steering(const Case& c, const Vector3d& kp, const Vector3d& kd, const GyroSteering& law = {}) {
  PhaseSetup setup;
  setup.gyros = c.gyros;
  setup.actuators.steering = law;
  AttitudeControl control;
  control.root = c.base, control.kp = kp, control.kd = kd;
  setup.attitude = control;
  return setup;
}

// A scissored pair rotates its base about one axis: (I + J_s sin^2 d) w + 2 h sin d = 0. The momentum h amplifies the
// small torque of the gimbal motors.
TEST(MomentGyros, ScissoredPairRotatesBase) {
  constexpr double I = 40, r = 0.4;
  const Case c = body_with({{{0, -1, 0}, {1, 0, 0}}, {{0, 1, 0}, {-1, 0, 0}}}, Symmetric3d::diagonal(50, 45, I));
  PhaseDynamics dynamics(c.model, commanding_rates(c, {r, r}));
  EXPECT_FALSE(dynamics.is_disturbed());
  const State start = spinning(c);
  double worst_rate = 0, worst_motor = 0, worst_spin = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 3, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
        const double t = s.time, e = std::exp(-kBandwidth * t);
        const double d = r * (t - (1 - e) / kBandwidth), d1 = r * (1 - e), d2 = r * kBandwidth * e;
        const double S = std::sin(d), C = std::cos(d), inertia = I + kJ * S * S;
        const double w = -2 * kH * S / inertia;
        const double w1 = (-2 * kH * C * d1 - 2 * kJ * S * C * d1 * w) / inertia;
        worst_rate = std::max(worst_rate, norm(rate_of(c, s.state) - Vector3d{0, 0, w}));
        // Euler's equations of gimbal and rotor about their axes.
        const double motor = kGimbal * d2 - w * C * (kH + 0.5 * kJ * S * w);
        const double spin = kJ * (w1 * S + w * C * d1);
        for (const MomentGyro& g : c.gyros) {
          EXPECT_NEAR(s.state.q[g.gimbal_coordinate], d, 1e-11);
          worst_motor = std::max(worst_motor, std::abs(s.motor[g.gimbal] - motor));
          worst_spin = std::max(worst_spin, std::abs(s.motor[g.rotor] - spin));
        }
        EXPECT_NEAR(s.dynamics->control_torque()[2], -2 * kH * C * d1,
                    1e-8);  // tolerance of the dense output of the rates
        EXPECT_LT(norm(totals(c.model, s.state).momentum.angular), 1e-12 * kH);
        EXPECT_NEAR(totals(c.model, s.state).energy - totals(c.model, start).energy, s.integrals.motor_work, 1e-9);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] base rate %.2g rad/s off, gimbal's torque %.2g, rotor's %.2g N m\n", worst_rate,
              worst_motor, worst_spin);
  EXPECT_LT(worst_rate, 1e-11);   // measured 3e-12
  EXPECT_LT(worst_motor, 1e-10);  // 2e-11
  EXPECT_LT(worst_spin, 1e-11);   // 1e-12
  EXPECT_GT(norm(rate_of(c, o.end_state)), 0.3);
}

// One gyro with nonzero total momentum: the base's motion follows from its conservation, R^T L = I(d) w + h + ...
TEST(MomentGyros, ConservesMomentum) {
  const Case c = body_with({{{0, 1, 0}, {1, 0, 0}}}, Symmetric3d::diagonal(50, 45, 40));
  PhaseDynamics dynamics(c.model, commanding_rates(c, {0.3}));
  State start = spinning(c);
  start.v[c.model.bodies()[c.base].v + 2] = 0.05;
  const Vector3d L = totals(c.model, start).momentum.angular;
  EXPECT_GT(norm(L), 10);
  double drift = 0, off = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 20, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
        drift = std::max(drift, norm(totals(c.model, s.state).momentum.angular - L) / norm(L));
        const Rotationd R = root_pose(c.model, s.state, c.base).R;
        const double d = s.state.q[c.gyros[0].gimbal_coordinate];
        const Vector3d axis{std::cos(d), 0, -std::sin(d)}, w = rate_of(c, s.state);
        // The rotor's inertia rotates with the gimbal; the gimbal's inertia is about its axis.
        Symmetric3d I = Symmetric3d::diagonal(50, 45, 40);
        const Symmetric3d before = about({1, 0, 0}, kJ), now = about(axis, kJ);
        for (double Symmetric3d::*entry : {&Symmetric3d::xx, &Symmetric3d::yy, &Symmetric3d::zz, &Symmetric3d::xy,
                                           &Symmetric3d::xz, &Symmetric3d::yz})
          I.*entry += now.*entry - before.*entry;
        const Vector3d h = (kJ * s.state.v[c.gyros[0].rotor_velocity]) * axis +
                           Vector3d{0, kGimbal * s.state.v[c.gyros[0].gimbal_velocity], 0};
        off = std::max(off, norm(transpose(R) * L - I * w - h));
        EXPECT_NEAR(totals(c.model, s.state).energy - totals(c.model, start).energy, s.integrals.motor_work, 1e-8);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] momentum drifts by %.2g, base's rate from it %.2g N m s off\n", drift, off);
  EXPECT_LT(drift, 1e-11);
  EXPECT_LT(off, 1e-11 * norm(L));
  EXPECT_GT(std::abs(o.end_state.q[c.gyros[0].gimbal_coordinate]), 5);
}

// Attitude control with a pyramid: it provides the commanded torque, the base reaches its attitude, momentum and energy
// balance.
TEST(MomentGyros, PyramidRotatesBase) {
  const Case c = body_with(pyramid(), Symmetric3d::diagonal(50, 45, 40), kNone, 2);
  PhaseSetup setup = steering(c, {4, 4, 4}, {25, 25, 25});
  setup.attitude->R_WD = rotation_matrix(Quaterniond{std::cos(0.2), std::sin(0.2), 0, 0});
  PhaseDynamics dynamics(c.model, setup);
  EXPECT_FALSE(dynamics.is_disturbed());
  State start = spinning(c);
  const double rate[3] = {0.02, -0.03, 0.04};
  for (int k = 0; k < 3; ++k) start.v[c.model.bodies()[c.base].v + k] = rate[k];
  const Vector3d L = totals(c.model, start).momentum.angular;
  const double energy = totals(c.model, start).energy;
  EXPECT_GT(norm(L), 2);
  double drift = 0, work = 0, lacking = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 120, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
        drift = std::max(drift, norm(totals(c.model, s.state).momentum.angular - L));
        work = std::max(work, std::abs(totals(c.model, s.state).energy - energy - s.integrals.motor_work));
        lacking = std::max(lacking, norm(s.dynamics->base().find<GyroEffector>()->array().lacking()));
        EXPECT_GT(s.dynamics->base().find<GyroEffector>()->array().singularity_measure(), 0.2);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] momentum drifts by %.2g N m s of %.3g, energy %.2g J of %.3g; torque lacking %.2g N m\n",
              drift, norm(L), work, energy, lacking);
  EXPECT_LT(drift, 1e-11 * 4 * kH);
  EXPECT_LT(work, 1e-9 * energy);
  EXPECT_LT(lacking, 1e-12);
  EXPECT_LT(norm(rate_of(c, o.end_state)), 1e-5);
  // All momentum is in the gyros now.
  Vector3d h = Vector3d::zero();
  for (const MomentGyro& g : c.gyros) h += momentum_of(g, o.end_state.q[g.gimbal_coordinate]);
  EXPECT_LT(norm(root_pose(c.model, o.end_state, c.base).R * h - L), 1e-3);
}

// Motors hold gimbals without commands at rest against the gyroscopic torque of h and the base's rate.
TEST(MomentGyros, GimbalsAtRestWhileBaseRotates) {
  const Case c = body_with({{{0, 1, 0}, {1, 0, 0}}}, Symmetric3d::diagonal(50, 45, 40));
  PhaseSetup setup;
  setup.gyros = c.gyros;
  PhaseDynamics dynamics(c.model, setup);
  State start = spinning(c, {0.4});
  start.v[c.model.bodies()[c.base].v + 2] = 0.1;
  double holding = 0;
  const PhaseOutcome o = simulate_phase(dynamics, {start, 0, 10, 0.5}, {}, {.observe = [&](const PhaseSample& s) {
                                          EXPECT_NEAR(s.state.q[c.gyros[0].gimbal_coordinate], 0.4, 1e-14);
                                          holding = std::max(holding, std::abs(s.motor[c.gyros[0].gimbal]));
                                          EXPECT_NEAR(totals(c.model, s.state).energy - totals(c.model, start).energy,
                                                      s.integrals.motor_work, 1e-9);
                                        }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(holding, 0.5);
}

// After an impact the motors restore the rates: deviations decay as exp(-k t), and the motors do the work.
TEST(MomentGyros, MotorsRestoreRates) {
  const Case c = body_with({{{0, 1, 0}, {1, 0, 0}}}, Symmetric3d::diagonal(50, 45, 40));
  PhaseSetup setup;
  setup.gyros = c.gyros;
  PhaseDynamics dynamics(c.model, setup);
  State start = spinning(c);
  start.v[c.gyros[0].rotor_velocity] += 3, start.v[c.gyros[0].gimbal_velocity] = 0.2;
  const Vector3d L = totals(c.model, start).momentum.angular;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
        const double e = std::exp(-kBandwidth * s.time);
        EXPECT_NEAR(s.state.v[c.gyros[0].rotor_velocity], kSpin + 3 * e, 1e-8);
        EXPECT_NEAR(s.state.v[c.gyros[0].gimbal_velocity], 0.2 * e, 1e-9);
        EXPECT_LT(norm(totals(c.model, s.state).momentum.angular - L), 1e-12 * norm(L));
        EXPECT_NEAR(totals(c.model, s.state).energy - totals(c.model, start).energy, s.integrals.motor_work, 1e-7);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
}

// A motor with insufficient torque saturates: the gimbal lags, momentum and energy are conserved.
TEST(MomentGyros, MotorsSaturate) {
  constexpr double most = 0.02, r = 0.4;
  const Case c =
      body_with({{{0, -1, 0}, {1, 0, 0}}, {{0, 1, 0}, {-1, 0, 0}}}, Symmetric3d::diagonal(3000, 3000, 4000), most);
  PhaseDynamics dynamics(c.model, commanding_rates(c, {r, r}));
  const State start = spinning(c);
  double largest = 0, drift = 0, on_base = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 4, 0.05}, {}, {.observe = [&](const PhaseSample& s) {
        largest = std::max(largest, std::abs(s.motor[c.gyros[0].gimbal]));
        drift = std::max(drift, norm(totals(c.model, s.state).momentum.angular));
        on_base = std::max(on_base, std::abs(s.dynamics->control_torque()[2]));
        // Until the gimbal is near its commanded rate, the motor applies its maximum torque against h w.
        if (s.time > 0.4) return;
        const double w = rate_of(c, s.state)[2], d = s.state.q[c.gyros[0].gimbal_coordinate];
        const double slope = s.dynamics->acceleration()[c.gyros[0].gimbal_velocity];
        EXPECT_NEAR(kGimbal * slope, most + w * std::cos(d) * (kH + 0.5 * kJ * std::sin(d) * w), 1e-10);
        EXPECT_NEAR(totals(c.model, s.state).energy - totals(c.model, start).energy, s.integrals.motor_work, 1e-9);
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_NEAR(largest, most, 1e-15);
  EXPECT_LT(drift, 1e-11 * kH);
  EXPECT_GT(on_base, 100 * most);  // rotation of two momenta: 2 h times their rate
}

// (17.8): minimum-norm rates for the torque, including the base's rotation; at the maximum rate all rates are scaled
// equally.
TEST(MomentGyros, SteeringIsMinimumNorm) {
  const Case c = body_with(pyramid(), Symmetric3d::diagonal(50, 45, 40), kNone, 0.5);
  GyroArray array(c.gyros);
  const State state = spinning(c, {0.3, -0.2, 0.5, 0.1});
  array.take(state.q);
  const Vector3d torque{2, -1, 3}, w{0.02, 0.05, -0.01};
  array.steer(torque, w, 7);
  EXPECT_LT(norm(array.lacking()), 1e-14);
  std::vector<double> v(state.v.size(), 0.0);
  for (std::size_t i = 0; i < 4; ++i) v[c.gyros[i].gimbal_velocity] = array.commanded()[i];
  EXPECT_LT(norm(array.torque_of(v, w) - torque), 1e-14);
  // The rates are orthogonal to the null space of A, computed from its minors.
  std::vector<Vector3d> A;
  for (const MomentGyro& g : c.gyros) A.push_back(cross(g.gimbal_axis, momentum_of(g, state.q[g.gimbal_coordinate])));
  const double null[4] = {dot(A[1], cross(A[2], A[3])), -dot(A[0], cross(A[2], A[3])), dot(A[0], cross(A[1], A[3])),
                          -dot(A[0], cross(A[1], A[2]))};
  double along = 0, size = 0;
  for (std::size_t i = 0; i < 4; ++i) along += null[i] * array.commanded()[i], size += null[i] * null[i];
  EXPECT_GT(size, 1);
  EXPECT_LT(std::abs(along), 1e-12 * std::sqrt(size));
  // Ten times the torque requires more than the maximum rate.
  const std::vector<double> before(array.commanded().begin(), array.commanded().end());
  array.steer(10.0 * torque, Vector3d::zero(), 7);
  double most = 0;
  for (const double rate : array.commanded()) most = std::max(most, std::abs(rate));
  EXPECT_NEAR(most, 0.5, 1e-15);
  EXPECT_GT(norm(array.lacking()), 1);
  EXPECT_LT(norm(cross(array.lacking(), torque)), 1e-12);  // the direction of the torque is unchanged
}

// Gimbal angles (-90, 0, 90, 0) deg: the derivatives of all momenta are in one plane. The singularity measure is zero,
// and the missing torque normal to the plane is reported. The dither moves the gimbals out of the singularity; damping
// alone does not.
TEST(MomentGyros, SingularitiesReportedAndEscaped) {
  const Case c = body_with(pyramid(), Symmetric3d::diagonal(50, 45, 40), kNone, 2);
  constexpr double quarter = 1.5707963267948966;
  const State singular = spinning(c, {-quarter, 0, quarter, 0});
  GyroArray plain(c.gyros, {0.2, 0.01, 0}), dithered(c.gyros, {0.2, 0.01, 0.1});
  const Vector3d across{1, 0, 0};
  for (GyroArray* array : {&plain, &dithered}) {
    array->take(singular.q);
    EXPECT_LT(array->singularity_measure(), 1e-7);
    array->steer(across, Vector3d::zero(), 0.5);
    EXPECT_GT(norm(array->lacking()), 0.5);  // the missing torque is reported
  }
  double damped = 0, moved = 0;
  for (const double rate : plain.commanded()) damped = std::max(damped, std::abs(rate));
  for (const double rate : dithered.commanded()) moved = std::max(moved, std::abs(rate));
  EXPECT_LT(damped, 1e-12);
  EXPECT_GT(moved, 1e-4);

  // From the singularity, control still brings the base to rest.
  PhaseDynamics dynamics(c.model, steering(c, {4, 4, 4}, {25, 25, 25}, {0.2, 0.01, 0.1}));
  State start = singular;
  start.v[c.model.bodies()[c.base].v] = -0.02;
  double lacking = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 200, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                       lacking = std::max(lacking, norm(s.dynamics->base().find<GyroEffector>()->array().lacking()));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  EXPECT_GT(lacking, 0.1);
  EXPECT_LT(norm(rate_of(c, o.end_state)), 1e-3);
  EXPECT_GT(norm(totals(c.model, o.end_state).momentum.angular), 1);
}

TEST(MomentGyros, RejectsMisuse) {
  const Case c = body_with(pyramid(), Symmetric3d::diagonal(50, 45, 40));
  std::vector<MomentGyro> gyros = c.gyros;
  gyros[0].spin_axis = gyros[0].gimbal_axis;
  EXPECT_THROW(GyroArray{gyros}, std::invalid_argument);
  gyros = c.gyros, gyros[1].spin_rate = 0;
  EXPECT_THROW(GyroArray{gyros}, std::invalid_argument);
  EXPECT_THROW(GyroArray(c.gyros, {0, 0.01, 0}), std::invalid_argument);
  EXPECT_THROW(GyroArray(c.gyros, {0.2, 0.01, 0.6}), std::invalid_argument);
  PhaseSetup setup = steering(c, {1, 1, 1}, {1, 1, 1});
  setup.gyros.resize(2);
  EXPECT_THROW(PhaseDynamics(c.model, setup), std::invalid_argument);  // too few gyros
  setup = steering(c, {1, 1, 1}, {1, 1, 1});
  std::swap(setup.gyros[0].gimbal, setup.gyros[0].rotor);
  EXPECT_THROW(PhaseDynamics(c.model, setup), std::invalid_argument);
  setup = commanding_rates(c, {0, 0, 0, 0});
  setup.clock = {};
  EXPECT_THROW(PhaseDynamics(c.model, setup), std::invalid_argument);  // no actuator receives the command
}

}  // namespace moment_gyros_test
}  // namespace grapnel::testing
