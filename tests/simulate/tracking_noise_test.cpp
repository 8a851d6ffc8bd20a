/// Sensor noise: determined by its seed, of the given magnitude, smooth; effect on each control.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/phase_case.hpp"
#include "simulate/small_models.hpp"

namespace grapnel::testing {
namespace tracking_noise_test {

TEST(TrackingNoise, IsAFunctionOfSeedAndJoint) {
  const TrackingNoise noise{0.01, 5, 0x123456789abcdef0};
  const NoiseSignal a(noise, 3), b(noise, 3), other_joint(noise, 4);
  TrackingNoise reseeded = noise;
  reseeded.seed += std::uint64_t{1} << 32;  // the upper half has an effect
  const NoiseSignal other_seed(reseeded, 3);
  std::vector<double> forwards, backwards;
  for (int k = 0; k < 50; ++k) forwards.push_back(a.at(0.37 * k).position);
  for (int k = 50; k-- > 0;) backwards.push_back(b.at(0.37 * k).position);
  for (int k = 0; k < 50; ++k) EXPECT_EQ(forwards[k], backwards[49 - k]);
  EXPECT_GT(std::abs(other_joint.at(1).position - a.at(1).position), 1e-4);
  EXPECT_GT(std::abs(other_seed.at(1).position - a.at(1).position), 1e-4);
}

// Philox 4x32-10 and the sum of tones, computed by a separate program in Python from the paper's description.
TEST(TrackingNoise, HasTheBitsOfPhilox) {
  const NoiseSignal n({0.01, 5, 0x123456789abcdef0}, 3);
  EXPECT_NEAR(n.at(0).position, 0.009230782986033892, 1e-16);
  EXPECT_NEAR(n.at(2.5).rate, -0.2671482621813896, 1e-12);
}

TEST(TrackingNoise, HasSpecifiedStandardDeviation) {
  double worst = 0;
  for (std::uint32_t joint = 0; joint < 10; ++joint) {
    const NoiseSignal n({0.02, 4, 7}, joint);
    double sum = 0, squares = 0;
    const int count = 40000;
    for (int k = 0; k < count; ++k) {
      const double x = n.at(0.05 * k).position;
      sum += x, squares += x * x;
    }
    const double mean = sum / count;
    worst = std::max(worst, std::abs(std::sqrt(squares / count - mean * mean) / 0.02 - 1));
    EXPECT_LT(std::abs(mean), 0.02 * 0.02);
  }
  std::printf("[ measured ] standard deviation over 2000 s: off by %.3g\n", worst);
  EXPECT_LT(worst, 0.03);
}

TEST(TrackingNoise, RateAndAccelerationAreDerivatives) {
  const NoiseSignal n({0.01, 5, 2}, 1);
  const double h = 1e-3;
  double rates = 0;
  for (int k = 0; k < 100; ++k) {
    const double t = 0.31 * k;
    const auto slope = [&](auto of) {
      return (8 * (of(t + h) - of(t - h)) - (of(t + 2 * h) - of(t - 2 * h))) / (12 * h);
    };
    const JointPoint p = n.at(t);
    EXPECT_NEAR(slope([&](double s) { return n.at(s).position; }), p.rate, 1e-7);
    EXPECT_NEAR(slope([&](double s) { return n.at(s).rate; }), p.acceleration, 1e-5);
    rates = std::max(rates, std::abs(p.rate));
  }
  EXPECT_GT(rates, 0.1);
  EXPECT_LT(rates, 0.01 * std::sqrt(2.0 * NoiseSignal::kTones) * 2 * M_PI * 5);  // all tones in phase at the band's end
}

TEST(TrackingNoise, ZeroForZeroSizeAndErrorsNamed) {
  EXPECT_EQ(NoiseSignal({0, 5, 1}, 0).at(3).position, 0);
  EXPECT_EQ(NoiseSignal().at(3).rate, 0);
  EXPECT_THROW(NoiseSignal({-0.1, 5, 1}, 0), std::invalid_argument);
  EXPECT_THROW(NoiseSignal({0.1, 0, 1}, 0), std::invalid_argument);
  EXPECT_THROW(NoiseSignal({NAN, 5, 1}, 0), std::invalid_argument);
}

TEST(TrackingNoise, PrescribedJointsFollowSensedReference) {
  Random random(3);
  const Model model = random_model({}, random);
  State start = random_state(model, random, 0.3);
  PhaseSetup setup;
  setup.drives = random_drives(model, start, JointControl::prescribed, 2, random);
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    setup.drives[j].noise = NoiseSignal({0.01, 3, 5}, static_cast<std::uint32_t>(j));
  }
  PhaseDynamics dynamics(model, setup);
  const State there = dynamics.state(0, dynamics.initial(start, 0));
  const Totals before = totals(model, there);
  double off = 0;
  const PhaseOutcome o = simulate_phase(
      dynamics, {there, 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
        for (std::size_t j = 0; j < setup.drives.size(); ++j) {
          const Body& body = model.bodies()[model.joints()[j]];
          const JointPoint p = evaluate(setup.drives[j].trajectory, s.time), n = setup.drives[j].noise.at(s.time);
          EXPECT_EQ(s.state.q[body.q], p.position - n.position);
          EXPECT_EQ(s.state.v[body.v], p.rate - n.rate);
        }
        // The energy balance requires prescribed accelerations consistent with the rates.
        off = std::max(off, std::abs(totals(model, s.state).energy - before.energy - s.integrals.motor_work -
                                     s.integrals.friction_work));
      }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("[ measured ] energy less work under noise, relative: %.3g\n", off / before.energy);
  EXPECT_LT(off, 1e-9 * before.energy);  // measured 7e-14
}

TEST(TrackingNoise, EntersPDThroughPositionAndRate) {
  const Model model = flywheel({});
  PhaseSetup setup;
  setup.drives = {{JointControl::pd, JointTrajectory::at_rest(1), 20, 2, NoiseSignal({0.02, 3, 5}, 0)}};
  PhaseDynamics dynamics(model, setup);
  double largest = 0;
  simulate_phase(dynamics, {turning(model, 0), 0, 2, 0.1}, {}, {.observe = [&](const PhaseSample& s) {
                   const JointPoint n = setup.drives[0].noise.at(s.time);
                   const double quiet = 20 * (1 - s.state.q[0]) - 2 * s.state.v[0];
                   EXPECT_NEAR(s.motor[0], quiet - 20 * n.position - 2 * n.rate, 1e-13);
                   largest = std::max(largest, std::abs(s.motor[0] - quiet));
                 }});
  EXPECT_GT(largest, 0.5);
}

// Under computed torque the error obeys e'' = -kd (e' + n') - kp (e + n), here by a separate Runge-Kutta integration.
TEST(TrackingNoise, DrivesTheErrorUnderComputedTorque) {
  Random random(8);
  RobotOptions options;
  options.min_bodies = 5, options.max_bodies = 5;
  const Model model = random_model(options, random);
  const State start = random_state(model, random, 0.3);
  PhaseSetup setup;
  setup.drives = random_drives(model, start, JointControl::computed_torque, 2, random);
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    setup.drives[j].kp = 9, setup.drives[j].kd = 4;
    setup.drives[j].noise = NoiseSignal({0.02, 2, 6}, static_cast<std::uint32_t>(j));
  }
  PhaseDynamics dynamics(model, setup);
  const State end = simulate_phase(dynamics, {start, 0, 2}).end_state;
  for (std::size_t j = 0; j < setup.drives.size(); ++j) {
    const NoiseSignal& noise = setup.drives[j].noise;
    const auto acceleration = [&](double t, double e, double rate) {
      const JointPoint n = noise.at(t);
      return -4 * (rate + n.rate) - 9 * (e + n.position);
    };
    double e = 0, w = 0;
    const double h = 1e-3;
    for (int k = 0; k < 2000; ++k) {
      const double t = k * h;
      const double a1 = acceleration(t, e, w), w2 = w + h / 2 * a1;
      const double a2 = acceleration(t + h / 2, e + h / 2 * w, w2), w3 = w + h / 2 * a2;
      const double a3 = acceleration(t + h / 2, e + h / 2 * w2, w3), w4 = w + h * a3;
      const double a4 = acceleration(t + h, e + h * w3, w4);
      e += h / 6 * (w + 2 * w2 + 2 * w3 + w4), w += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    const Body& body = model.bodies()[model.joints()[j]];
    EXPECT_GT(std::abs(e), 1e-4);
    EXPECT_NEAR(end.q[body.q] - evaluate(setup.drives[j].trajectory, 2).position, e, 1e-10);
  }
}

}  // namespace tracking_noise_test
}  // namespace grapnel::testing
