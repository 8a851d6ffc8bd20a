/// Sampled control: stability bounds and growth rates against exact roots, delays, held commands, user-defined
/// controllers.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace sampled_control_test {

constexpr double kPeriod = 0.01;

// Rate damping -D rate of a wheel of inertia J, with DT/J = `a`.
PhaseSetup damped(const Model& model, double a, double delay) {
  PhaseSetup setup;
  setup.drives = {{JointControl::pd, JointTrajectory::at_rest(0), 0, a * kWheelInertia / kPeriod}};
  setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, delay}, model.joints().size());
  return setup;
}

// The rates at the samples by the exact recursion: the torque is constant between two edges, so the rate is linear. In
// the first part of a period the command of one sample acts, in the rest that of the next sample. The delay is less
// than two periods.
std::vector<double> exact_rates(double a, double delay, int samples) {
  const int whole = static_cast<int>(std::floor(delay / kPeriod + 1e-9));
  const double part = std::max(0.0, delay / kPeriod - whole);  // fraction of a period
  std::vector<double> w = {1};
  const auto at = [&](int k) { return k < 0 ? 0.0 : w[k]; };
  for (int k = 0; k < samples; ++k) w.push_back(w[k] - a * (part * at(k - whole - 1) + (1 - part) * at(k - whole)));
  return w;
}

// The simulated rates, exactly at the samples: the last value of each segment.
std::vector<double> simulated_rates(double a, double delay, int samples, double& lost) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, damped(model, a, delay));
  std::vector<double> w;
  lost = 0;
  double scale = 0;
  const double before = kWheelInertia / 2;
  const PhaseOutcome o = simulate_phase(
      dynamics, {turning(model, 1), 0, samples * kPeriod, kPeriod}, {}, {.observe = [&](const PhaseSample& s) {
        const double energy = kWheelInertia / 2 * s.state.v[0] * s.state.v[0];
        scale = std::max({scale, energy, before});
        lost = std::max(lost, std::abs(energy - before - s.integrals.motor_work) / scale);
        w.push_back(s.state.v[0]);
      }});
  EXPECT_TRUE(o.finished) << o.failure;
  return w;
}

TEST(SampledControl, FollowsTheExactRecursionForAnyDelay) {
  double off = 0, lost = 0;
  for (const double delay : {0.0, 0.25, 0.7, 1.0, 1.5}) {
    for (const double a : {0.1, 0.6, 1.3}) {
      constexpr int kSamples = 40;
      const std::vector<double> exact = exact_rates(a, delay * kPeriod, kSamples);
      double lost_here = 0;
      const std::vector<double> w = simulated_rates(a, delay * kPeriod, kSamples, lost_here);
      ASSERT_EQ(w.size(), exact.size());
      double largest = 0;
      for (const double x : exact) largest = std::max(largest, std::abs(x));
      for (std::size_t k = 0; k < w.size(); ++k) off = std::max(off, std::abs(w[k] - exact[k]) / largest);
      lost = std::max(lost, lost_here);
    }
  }
  std::printf("[ measured ] sampled damping against the recursion: %.3g; energy against held torques' work: %.3g\n",
              off, lost);
  EXPECT_LT(off, 1e-12);
  EXPECT_LT(lost, 1e-12);
}

// Growth per sample, between two samples far apart.
double growth(double a, double delay) {
  double lost = 0;
  constexpr int kFar = 400;
  const std::vector<double> w = simulated_rates(a, delay, kFar, lost);
  // Envelope of an oscillation: w_k^2 - w_{k+1} w_{k-1} grows by the product of both roots.
  const auto envelope = [&](int k) { return std::sqrt(std::abs(w[k] * w[k] - w[k + 1] * w[k - 1])); };
  if (delay == 0) return std::pow(std::abs(w[kFar] / w[100]), 1.0 / (kFar - 100));
  return std::pow(envelope(kFar - 1) / envelope(100), 1.0 / (kFar - 101));
}

// z = 1 - a: stable exactly for D < 2J/T. With one sample of delay z^2 - z + a = 0, |z| = sqrt(a): for D < J/T.
TEST(SampledControl, RateDampingIsStableUpToTheExactBound) {
  double off = 0;
  for (const double a : {1.9, 1.99, 2.005, 2.02}) {
    const double measured = growth(a, 0);
    off = std::max(off, std::abs(measured - std::abs(1 - a)));
    EXPECT_EQ(measured < 1, a < 2) << a;
  }
  for (const double a : {0.9, 0.99, 1.01, 1.03}) {
    const double measured = growth(a, kPeriod);
    off = std::max(off, std::abs(measured - std::sqrt(a)));
    EXPECT_EQ(measured < 1, a < 1) << a;
  }
  std::printf("[ measured ] growth per sample against the roots: %.3g\n", off);
  EXPECT_LT(off, 1e-12);
}

// The same for a free body under attitude control about one axis, with an external torque.
TEST(SampledControl, DampsBaseByExternalTorque) {
  const Model model = one_body(Symmetric3d::diagonal(2, 3, 4));
  constexpr double kDamping = 3 * 1.5 / kPeriod;  // a = 1.5 about y
  PhaseSetup setup;
  setup.attitude = {0, Rotationd::identity(), Vector3d::zero(), {kDamping, kDamping, kDamping}};
  setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, 0}, 0);
  PhaseDynamics dynamics(model, setup);
  State start = zero_state(model);
  start.v[1] = 1;
  double off = 0, lost = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {start, 0, 20 * kPeriod, kPeriod}, {}, {.observe = [&](const PhaseSample& s) {
        off = std::max(off, std::abs(s.state.v[1] - std::pow(-0.5, std::round(s.time / kPeriod))));
        lost = std::max(lost, std::abs(3 * (s.state.v[1] - 1) - s.integrals.external_impulse.angular[1]));
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] sampled base: rate %.3g, impulse %.3g\n", off, lost);
  EXPECT_LT(off, 1e-13);
  EXPECT_LT(lost, 1e-12);
}

TEST(SampledControl, ReportsUnstableLoop) {
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, damped(model, 4, 0));  // grows by 3 per sample
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 1), 0, 10, 1});
  EXPECT_FALSE(o.finished);
  EXPECT_NEAR(o.end_time, 0.09, 1e-12);  // 3^9 = 19683
  EXPECT_NEAR(std::abs(o.end_state.v[0]), 19683, 1e-6);
  EXPECT_NE(o.failure.find("sampled control is unstable: at t = 0.09 s joint"), std::string::npos) << o.failure;
  EXPECT_NE(o.failure.find("the sample time of 0.01 s"), std::string::npos) << o.failure;
}

// Held and delayed commands persist across segments; a step never crosses an edge.
TEST(SampledControl, HoldsAcrossSegments) {
  const Model model = flywheel({});
  const double delay = 1.3 * kPeriod;
  const auto run = [&](const std::vector<double>& ends) {
    const PhaseSetup setup = damped(model, 0.8, delay);
    State state = turning(model, 1);
    double t = 0;
    for (const double end : ends) {
      PhaseDynamics dynamics(model, setup);  // with the same clock
      const PhaseOutcome o = simulate_phase(dynamics, {state, t, end});
      EXPECT_TRUE(o.finished) << o.failure;
      state = o.end_state, t = end;
    }
    return state.v[0];
  };
  const double whole = run({0.2});
  EXPECT_NEAR(whole, exact_rates(0.8, delay, 20).back(), 1e-13);
  for (const std::vector<double>& ends : std::vector<std::vector<double>>{
           {0.037, 0.0412, 0.2}, {0.05, 0.2}, {5 * kPeriod + delay, 0.1, 0.2}, {kPeriod, 2 * kPeriod, 0.2}})
    EXPECT_NEAR(run(ends), whole, 1e-13) << ends[0];
}

TEST(SampledControl, ComputedTorqueAndNoiseAreReadAtTheSamples) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives = {{JointControl::computed_torque, JointTrajectory::at_rest(0.5), 9, 3}};
  setup.drives[0].noise = NoiseSignal({1e-3, 5, 7}, 0);
  setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, 0}, 1);
  PhaseDynamics dynamics(model, setup);
  double q = 0, w = 0, off = 0;
  for (int k = 0; k < 30; ++k) {  // the recursion, with the sensor's error at the sample
    const JointPoint n = setup.drives[0].noise.at(k * kPeriod);
    const double a = 9 * (0.5 - n.position - q) + 3 * (-n.rate - w);
    q += w * kPeriod + a * kPeriod * kPeriod / 2, w += a * kPeriod;
  }
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 0), 0, 30 * kPeriod});
  ASSERT_TRUE(o.finished);
  off = std::max(std::abs(o.end_state.q[0] - q), std::abs(o.end_state.v[0] - w));
  std::printf("[ measured ] sampled computed torque with noise: %.3g\n", off);
  EXPECT_LT(off, 1e-13);
  EXPECT_GT(std::abs(setup.drives[0].noise.at(0.1).position), 1e-5);
}

// A user-defined controller equivalent to pd.
class OwnPd final : public Controller {
 public:
  void begin_segment(const Model&, double) override { ++segments; }
  void update(const ControlInput& in, ControlCommand& out) override {
    ++updates;
    for (std::size_t j = 0; j < out.effort.size(); ++j)
      out.effort[j] = value * (20 * (in.reference[j].position - in.sensed[j].position) +
                               2 * (in.reference[j].rate - in.sensed[j].rate));
    out.base_torque = {0, 0, base};
  }
  double value = 1, base = 0;
  int segments = 0, updates = 0;
};

TEST(Controller, EqualsBuiltInLaw) {
  const Model model = flywheel({});
  for (const bool sampled : {false, true}) {
    PhaseSetup setup;
    setup.drives = {{JointControl::pd, JointTrajectory::at_rest(1), 20, 2}};
    if (sampled) setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, kPeriod}, 1);
    PhaseDynamics law(model, setup);
    const PhaseOutcome expected = simulate_phase(law, {turning(model, 0), 0, 1});
    const auto own = std::make_shared<OwnPd>();
    setup.drives[0].control = JointControl::controller;
    setup.controller = own;
    if (sampled) setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, kPeriod}, 1);
    PhaseDynamics dynamics(model, setup);
    const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 0), 0, 1});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_NEAR(o.end_state.q[0], expected.end_state.q[0], 1e-12);
    EXPECT_NEAR(o.integrals.motor_work, expected.integrals.motor_work, 1e-12);
    EXPECT_GT(o.integrals.motor_work, 0.1);
    EXPECT_EQ(own->segments, 1);
    EXPECT_EQ(sampled ? own->updates : 100, 100);
  }
}

TEST(Controller, LimitedAndRejectedIfNotFinite) {
  const Model model = flywheel({}, 0.2);
  const auto own = std::make_shared<OwnPd>();
  PhaseSetup setup;
  setup.drives = {{JointControl::controller, JointTrajectory::at_rest(5)}};
  EXPECT_THROW(PhaseDynamics(model, setup), std::invalid_argument);
  setup.controller = own;
  setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, 0}, 1);
  PhaseDynamics dynamics(model, setup);
  simulate_phase(dynamics, {turning(model, 0), 0, 0.1}, {},
                 {.observe = [](const PhaseSample& s) { EXPECT_EQ(s.motor[0], 0.2); }});
  own->value = NAN;
  const PhaseOutcome o = simulate_phase(dynamics, {turning(model, 0), 0.1, 0.2});
  EXPECT_FALSE(o.finished);
  EXPECT_EQ(o.end_time, 0.1);
  EXPECT_NE(o.failure.find("at t = 0.1 s the controller returns an effort of nan at joint"), std::string::npos)
      << o.failure;
}

TEST(Controller, RotatesBase) {
  const Model model = one_body(Symmetric3d::diagonal(2, 3, 4));
  const auto own = std::make_shared<OwnPd>();
  own->base = 0.8;
  PhaseSetup setup;
  setup.controller = own;
  setup.commanded_root = 0;
  for (const bool sampled : {false, true}) {
    if (sampled) setup.clock = std::make_shared<ControlClock>(ControlTiming{kPeriod, 0.5 * kPeriod}, 0);
    PhaseDynamics dynamics(model, setup);
    EXPECT_TRUE(dynamics.is_disturbed());
    const PhaseOutcome o = simulate_phase(dynamics, {zero_state(model), 0, 1});
    ASSERT_TRUE(o.finished) << o.failure;
    EXPECT_NEAR(o.end_state.v[2], 0.2 * (sampled ? 1 - 0.5 * kPeriod : 1), 1e-13);
    EXPECT_NEAR(o.integrals.external_impulse.angular[2], 4 * o.end_state.v[2], 1e-12);
  }
  setup.attitude = AttitudeControl{0};
  EXPECT_THROW(PhaseDynamics(model, setup), std::invalid_argument);
}

TEST(ControlClock, RejectsInvalidTiming) {
  EXPECT_THROW(ControlClock({0, 0}, 1), std::invalid_argument);
  EXPECT_THROW(ControlClock({0.1, -1}, 1), std::invalid_argument);
  EXPECT_THROW(ControlClock({NAN, 0}, 1), std::invalid_argument);
  const Model model = flywheel({});
  PhaseDynamics dynamics(model, damped(model, 0.5, 0));
  EXPECT_THROW(simulate_phase(dynamics, {turning(model, 1), 1, 0}), std::logic_error);
}

}  // namespace sampled_control_test
}  // namespace grapnel::testing
