#pragma once

// A joint with an exact solution that gets an impulse, and logs of its encoder and gyroscope.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "grapnel/compare/log_fit.hpp"

namespace grapnel::joint_experiment {

inline constexpr double kImpact = 2;  // [s]
inline constexpr double kEnd = 12;    // [s]
inline constexpr double kReference = kEnd / 2;

// A joint with inertia and viscous friction about a spring gets an impulse. Before it, it moves by its spring alone.
struct Joint {
  double inertia = 2, friction = 0.6, impulse = 1, spring = 3;

  // Angle and rate at a time.
  std::array<double, 2> state(double t) const {
    std::array<double, 2> x = free({0.1, 0}, std::min(t, kImpact));
    if (t < kImpact) return x;
    x[1] += impulse / inertia;
    return free(x, t - kImpact);
  }
  std::array<double, 2> free(std::array<double, 2> x, double t) const {
    const double a = friction / (2 * inertia), w = std::sqrt(spring / inertia - a * a), e = std::exp(-a * t);
    const double c = std::cos(w * t), s = std::sin(w * t), b = (x[1] + a * x[0]) / w;
    return {e * (x[0] * c + b * s), e * (x[1] * c - (a * b + w * x[0]) * s)};
  }
};

inline RunCurve curve_of(const Joint& joint, std::size_t which) {
  std::vector<double> time, values;
  for (int k = 0; k <= 600; ++k) {
    const double t = 0.02 * k;
    if (k == 100) time.push_back(kImpact), values.push_back(joint.state(std::nextafter(kImpact, 0.0))[which]);
    time.push_back(t), values.push_back(joint.state(t)[which]);
  }
  return {std::move(time), std::move(values), 1};
}

struct Sensors {
  double encoder = 2e-3, gyro = 5e-3;     // noise [rad, rad/s]
  double bias = 0, bias_uncertainty = 0;  // of the gyro [rad/s]
  double offset = 0, drift = 0;           // of the clock: run = log + offset + drift (log - kReference)
  double lost = 0;                        // share of samples without a value, and of a gap [1]
  double friction_torque = 0;             // that the model lacks, as a slow decay of the angle
};

// A log with 10 Hz of encoder and 25 Hz of gyroscope.
using Quantities = std::vector<ComparedQuantity>;

inline Quantities measured(const Joint& joint, const Sensors& sensors, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Quantities all;
  for (const std::size_t which : {0u, 1u}) {
    ComparedQuantity one{.name = which == 0 ? "encoder" : "gyro",
                         .run = which == 0 ? "joint/angle" : "joint/rate",
                         .unit = which == 0 ? "rad" : "rad/s",
                         .components = {""},
                         .columns = {"column"},
                         .time = {},
                         .measured = {},
                         .curve = curve_of(joint, which),
                         .is_orientation = false,
                         .uncertainty = which == 0 ? sensors.encoder : sensors.gyro,
                         .bias_uncertainty = {},
                         .aligns = true};
    if (which == 1) one.bias_uncertainty = sensors.bias_uncertainty;
    const double interval = which == 0 ? 0.1 : 0.04;
    for (double t = 0.013; t < kEnd; t += interval) {
      const double true_value = joint.state(t)[which] - sensors.friction_torque * std::sin(0.8 * t);
      one.time.push_back((t - sensors.offset + sensors.drift * kReference) / (1 + sensors.drift));
      const double value = true_value + *one.uncertainty * normal(random) + (which == 1 ? sensors.bias : 0);
      const bool is_lost =
          sensors.lost > 0 && (uniform(random) < sensors.lost || std::abs(t / kEnd - 0.7) < sensors.lost / 2);
      one.measured.push_back(is_lost ? std::numeric_limits<double>::quiet_NaN() : value);
    }
    all.push_back(std::move(one));
  }
  return all;
}

using JointModel = std::function<Joint(std::span<const double>)>;

inline FittedLog log_of(Quantities quantities, JointModel model, std::string name = "log") {
  FittedLog log;
  log.name = std::move(name);
  log.simulate = [quantities = std::move(quantities), model = std::move(model)](std::span<const double> values,
                                                                                const std::stop_token&) {
    Quantities now = quantities;
    const Joint joint = model(values);
    for (std::size_t which = 0; which < 2; ++which) now[which].curve = curve_of(joint, which);
    return now;
  };
  return log;
}

inline Joint three(std::span<const double> v) { return {v[0], v[1], v[2], 3}; }

inline LogFitProblem problem_of(const Quantities& quantities, const JointModel& model = three) {
  LogFitProblem problem;
  problem.parameters = {{"inertia", "kg m^2", 0.5, 8, 3, true, {}},
                        {"friction", "N m s/rad", 0, 3, 0.3, false, {}},
                        {"impulse", "N m s", 0.1, 5, 2, false, {}}};
  problem.logs = {log_of(quantities, model)};
  problem.settings.starts = 1;
  problem.settings.tolerance = 1e-12;
  return problem;
}

// Fits of many draws of noise, bias, dropouts, offset and drift of the clock: errors in units of the stated
// uncertainties.
inline void check_draws(int draws) {
  const Joint truth;
  std::array<int, 3> inside{};
  int offset_inside = 0, drift_inside = 0, agreed = 0;
  double normalized = 0, worst_offset = 0, bias_normalized = 0;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  for (int draw = 0; draw < draws; ++draw) {
    Sensors sensors;
    sensors.bias_uncertainty = 0.02, sensors.bias = 0.02 * normal(random), sensors.offset = uniform(random);
    sensors.drift = 0.02 * uniform(random), sensors.lost = 0.1;
    LogFitProblem problem = problem_of(measured(truth, sensors, 100 + static_cast<unsigned>(draw)));
    problem.logs[0].fits_offset = true;
    problem.logs[0].offset_range = {-0.5, 0.5};
    problem.logs[0].fits_drift = true, problem.logs[0].largest_drift = 0.02, problem.logs[0].reference = kReference;
    const LogFit fit = fit_logs(problem, {});
    ASSERT_TRUE(fit.converged) << draw;
    agreed += fit.agrees == Verdict::yes ? 1 : 0;
    ASSERT_EQ(fit.in_covariance.size(), 3u);
    const Eigen::Vector3d error(fit.best[0] - truth.inertia, fit.best[1] - truth.friction, fit.best[2] - truth.impulse);
    normalized += error.dot(Eigen::Matrix3d(fit.covariance).inverse() * error);
    for (int k = 0; k < 3; ++k)
      inside[static_cast<std::size_t>(k)] += std::abs(error[k]) < 1.96 * std::sqrt(fit.covariance(k, k)) ? 1 : 0;
    const double offset = fit.logs[0].clock.offset - sensors.offset;
    offset_inside += std::abs(offset) < 1.96 * *fit.logs[0].offset_uncertainty ? 1 : 0;
    worst_offset = std::max(worst_offset, std::abs(offset) / *fit.logs[0].offset_uncertainty);
    ASSERT_TRUE(fit.logs[0].drift_uncertainty) << draw;
    drift_inside += std::abs(fit.logs[0].clock.drift - sensors.drift) < 1.96 * *fit.logs[0].drift_uncertainty ? 1 : 0;
    ASSERT_EQ(fit.logs[0].biases.size(), 1u);
    const BiasEstimate& bias = fit.logs[0].biases[0];
    bias_normalized += std::pow((bias.value - sensors.bias) / bias.uncertainty, 2);
  }
  // The sum of 3 n squares of normal numbers has the standard deviation sqrt(6 n).
  const double n = draws;
  EXPECT_NEAR(normalized, 3 * n, 5 * std::sqrt(6 * n)) << normalized / n;        // measured 3.0 n
  EXPECT_NEAR(bias_normalized, n, 5 * std::sqrt(2 * n)) << bias_normalized / n;  // measured 1.0 n
  const double spread = 4.5 * std::sqrt(n * 0.95 * 0.05);
  for (const int count : inside) EXPECT_NEAR(count, 0.95 * n, spread);
  EXPECT_NEAR(offset_inside, 0.95 * n, spread);
  EXPECT_NEAR(drift_inside, 0.95 * n, spread);
  std::cout << inside[0] << " " << inside[1] << " " << inside[2] << " " << offset_inside << " " << drift_inside
            << " of " << draws << " draws inside their 95 % intervals\n";
  EXPECT_LT(worst_offset, 5.5);
  EXPECT_GE(agreed, 0.99 * n - 2);
}

}  // namespace grapnel::joint_experiment
