// Parameters from synthetic logs of a model with an exact solution: coverage of the intervals, clocks, biases, wrong
// models, combinations that are not identifiable, bounds, local minima, and logs that contradict each other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "fit/joint_experiment.hpp"
#include "grapnel/compare/log_fit.hpp"
#include "grapnel/compare/log_fitter.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace log_fit_test {

using namespace joint_experiment;
using Quantities = joint_experiment::Quantities;

TEST(LogFit, IntervalsContainTheTruthInNinetyFivePercentOfDraws) { check_draws(test::repetitions(64)); }

TEST(LogFit, FindsClocksToATenthOfAMillisecond) {
  Sensors sensors;
  sensors.encoder = 1e-5, sensors.gyro = 2e-5;
  sensors.offset = 0.2371, sensors.drift = 3e-4;
  LogFitProblem problem = problem_of(measured({}, sensors, 1));
  problem.logs[0].fits_offset = problem.logs[0].fits_drift = true;
  problem.logs[0].offset_range = {-0.5, 0.5};
  problem.settings.starts = 3;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
  EXPECT_NEAR(fit.logs[0].clock.offset + fit.logs[0].clock.drift * (kEnd / 2 - fit.logs[0].clock.reference - 0.2371),
              sensors.offset, 1e-4);                          // measured 2e-5
  EXPECT_NEAR(fit.logs[0].clock.drift, sensors.drift, 5e-5);  // measured 8e-6
  EXPECT_LT(*fit.logs[0].offset_uncertainty, 1e-4);           // measured 2.5e-5
  // Without the drift the log contradicts the model.
  problem.logs[0].fits_drift = false;
  EXPECT_EQ(fit_logs(problem, {}).agrees, Verdict::no);
}

TEST(LogFit, EstimatesAFreeBias) {
  Sensors sensors;
  sensors.bias = 0.4;
  Quantities quantities = measured({}, sensors, 3);
  quantities[1].bias_uncertainty = std::numeric_limits<double>::infinity();
  const LogFit fit = fit_logs(problem_of(quantities), {});
  EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
  ASSERT_EQ(fit.logs[0].biases.size(), 1u);
  EXPECT_NEAR(fit.logs[0].biases[0].value, 0.4, 5 * fit.logs[0].biases[0].uncertainty);
  EXPECT_LT(fit.logs[0].biases[0].uncertainty, 2e-3);  // measured 3e-4
  // Without a bias the model must explain it, and does not.
  quantities[1].bias_uncertainty = 0;
  EXPECT_EQ(fit_logs(problem_of(quantities), {}).agrees, Verdict::no);
}

TEST(LogFit, DetectsAWrongModel) {
  Sensors sensors;
  const LogFit right = fit_logs(problem_of(measured({}, sensors, 4)), {});
  EXPECT_EQ(right.agrees, Verdict::yes);
  ASSERT_TRUE(right.parameters[0].interval);
  // The model has no friction.
  const auto frictionless = [](std::span<const double> v) { return Joint{v[0], 0, v[1], 3}; };
  LogFitProblem wrong = problem_of(measured({}, sensors, 4), frictionless);
  wrong.parameters.erase(wrong.parameters.begin() + 1);
  const LogFit fit = fit_logs(wrong, {});
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.agrees, Verdict::no);
  EXPECT_GT(fit.chi_square.per_number(), 10 * fit.chi_square.bound);  // measured 100
  EXPECT_FALSE(fit.parameters[0].interval);
  // A disturbance of the size of the noise.
  sensors.friction_torque = 5e-3;
  EXPECT_EQ(fit_logs(problem_of(measured({}, sensors, 4)), {}).agrees, Verdict::no);
}

TEST(LogFit, NamesCombinationsThatAreNotIdentifiable) {
  // The impulse is the product of two parameters.
  const JointModel product = [](std::span<const double> v) { return Joint{v[0], 0.6, v[1] * v[2], 3}; };
  for (const bool is_logarithmic : {true, false}) {
    LogFitProblem problem = problem_of(measured({}, {}, 5), product);
    problem.parameters[1] = {"mass", "kg", 0.2, 5, 1.5, is_logarithmic, {}};
    problem.parameters[2] = {"speed", "m/s", 0.2, 5, 0.9, is_logarithmic, {}};
    const LogFit fit = fit_logs(problem, {});
    EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
    EXPECT_NEAR(fit.best[1] * fit.best[2], 1, 0.01);
    EXPECT_EQ(fit.parameters[0].status, ParameterStatus::identified);
    EXPECT_TRUE(fit.parameters[0].interval);
    for (const std::size_t k : {1u, 2u}) {
      EXPECT_EQ(fit.parameters[k].status, ParameterStatus::not_identifiable);
      EXPECT_FALSE(fit.parameters[k].uncertainty);
      EXPECT_FALSE(fit.parameters[k].interval);
    }
    ASSERT_EQ(fit.combinations.size(), 3u);
    EXPECT_TRUE(fit.combinations[1].is_identifiable);
    EXPECT_FALSE(fit.combinations[2].is_identifiable);
    const std::vector<double>& v = fit.combinations[2].direction;
    EXPECT_NEAR(v[0], 0, 1e-3);
    // Along it the product is constant: dm / m = -dv / v.
    const double ratio = is_logarithmic ? 1 : fit.best[1] / fit.best[2];
    EXPECT_NEAR(v[1] / v[2], -ratio, 0.01 * ratio);
    // A prior on one of them identifies both.
    problem.parameters[1].uncertainty = 0.05;
    const LogFit with_prior = fit_logs(problem, {});
    EXPECT_EQ(with_prior.parameters[1].status, ParameterStatus::from_prior);
    EXPECT_NEAR(*with_prior.parameters[1].uncertainty, 0.05, 0.001);
    EXPECT_EQ(with_prior.parameters[2].status, ParameterStatus::identified);
    EXPECT_NEAR(*with_prior.parameters[2].uncertainty, 0.05 / 1.5 * with_prior.best[2], 0.001);
  }
}

TEST(LogFit, StatesThatAParameterIsAtABound) {
  LogFitProblem problem = problem_of(measured({}, {}, 6));
  problem.parameters[1].to = 0.4;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.best[1], 0.4);
  EXPECT_EQ(fit.parameters[1].status, ParameterStatus::at_upper_bound);
  EXPECT_FALSE(fit.parameters[1].interval);
  EXPECT_EQ(fit.agrees, Verdict::no);
}

// The search moves a parameter that nothing depends on to a bound by rounding errors; that is no estimate.
TEST(LogFit, HoldsNoParameterWithoutEffectAtABound) {
  LogFitProblem problem = problem_of(measured({}, {}, 6), [](std::span<const double> v) {
    return Joint{v[0], v[1], v[2] * (1 + 1e-9 * v[3]), 3};
  });
  problem.parameters.push_back({"colour", "1", 0, 1, 1, false, {}});
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
  EXPECT_TRUE(fit.best[3] == 0 || fit.best[3] == 1) << fit.best[3];
  EXPECT_EQ(fit.parameters[3].status, ParameterStatus::not_identifiable);
  EXPECT_FALSE(fit.combinations.back().is_identifiable);
  for (const std::size_t k : {0u, 1u, 2u}) EXPECT_EQ(fit.parameters[k].status, ParameterStatus::identified);
}

// The prior is one number among hundreds, so that chi-square alone would not show the contradiction.
TEST(LogFit, DisagreesWithAPriorThatTheLogsContradict) {
  LogFitProblem problem = problem_of(measured({}, {}, 6));
  problem.parameters[2].start = 1.06, problem.parameters[2].uncertainty = 0.01;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_TRUE(fit.chi_square.agrees());
  EXPECT_EQ(fit.agrees, Verdict::no);
  EXPECT_THAT(fit.reason, testing::HasSubstr("standard uncertainties of its prior"));
  problem.parameters[2].start = 1.02;
  EXPECT_EQ(fit_logs(problem, {}).agrees, Verdict::yes);
}

TEST(LogFit, WarnsOfADriftThatIsNotDetermined) {
  LogFitProblem problem = problem_of(measured({}, {}, 6));
  problem.logs[0].fits_offset = problem.logs[0].fits_drift = true;
  problem.logs[0].offset_range = {-0.5, 0.5};
  problem.logs[0].largest_drift = 0.01;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_GT(*fit.logs[0].drift_uncertainty, 1e-4);
  EXPECT_THAT(fit.warnings, testing::Not(testing::Contains(testing::HasSubstr("is not determined"))));
  problem.logs[0].largest_drift = 2 * std::max(std::abs(fit.logs[0].clock.drift), *fit.logs[0].drift_uncertainty);
  EXPECT_THAT(fit_logs(problem, {}).warnings, testing::Contains(testing::HasSubstr("the drift of the clock is not")));
}

TEST(LogFit, RejectsStepsToRunsThatFail) {
  const auto fails = [](std::span<const double> v) -> Joint {
    if (v[0] > 3.2 || v[2] < 0.95) throw std::runtime_error("the target escapes");
    return three(v);
  };
  LogFitProblem problem = problem_of(measured({}, {}, 7), fails);
  problem.settings.starts = 5;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_GT(fit.failed_runs, 0u);
  EXPECT_GT(fit.failed_starts, 0u);
  EXPECT_NEAR(fit.best[0], 2, 0.05);
  EXPECT_EQ(fit.agrees, Verdict::yes);
  const bool is_named = std::any_of(fit.evaluations.begin(), fit.evaluations.end(), [](const FitEvaluation& one) {
    return !one.chi_square && one.reason == "the target escapes";
  });
  EXPECT_TRUE(is_named);
  problem.parameters[0].from = 4;
  const LogFit none = fit_logs(problem, {});
  EXPECT_EQ(none.failure, "the target escapes");
}

TEST(LogFit, ListsLocalMinima) {
  // The spring, whose frequency has many local minima, is unknown.
  const auto springs = [](std::span<const double> v) { return Joint{2, 0.05, 1, v[0]}; };
  Joint truth;
  truth.friction = 0.05;
  LogFitProblem problem = problem_of(measured(truth, {}, 8), springs);
  problem.parameters = {{"spring", "N m/rad", 0.2, 30, 25, true, {}}};
  problem.settings.starts = 1;
  const LogFit alone = fit_logs(problem, {});
  EXPECT_GT(std::abs(alone.best[0] - 3), 1);
  EXPECT_EQ(alone.agrees, Verdict::no);
  problem.settings.starts = 12;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_NEAR(fit.best[0], 3, 0.01);
  EXPECT_EQ(fit.agrees, Verdict::yes);
  EXPECT_GE(fit.minima.size(), 3u);
  EXPECT_LT(fit.minima[0].chi_square, 0.1 * fit.minima[1].chi_square);
}

// Runs of some parameters end early: with few samples, or before the first sample.
TEST(LogFit, PrefersRunsWithTheSamplesOfTheLog) {
  for (const double end : {0.3, 0.005}) {
    const Quantities log = measured({}, {}, 7);
    LogFitProblem problem = problem_of(log);
    problem.logs[0].simulate = [log, end](std::span<const double> v, const std::stop_token&) {
      Quantities now = log;
      for (std::size_t which = 0; which < 2; ++which) {
        now[which].curve = curve_of(three(v), which);
        if (v[0] < 3.2) continue;
        std::vector<double> time, values;
        for (int k = 0; k <= 20; ++k) time.push_back(end * k / 20), values.push_back(Joint{}.state(time.back())[which]);
        now[which].curve = {time, values, 1};
      }
      return now;
    };
    problem.settings.starts = 5;
    const LogFit fit = fit_logs(problem, {});
    EXPECT_NEAR(fit.best[0], 2, 0.05);
    EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
    ASSERT_FALSE(fit.minima.empty());
    EXPECT_EQ(fit.minima[0].values, fit.best);
    EXPECT_GT(fit.minima[0].numbers, 400);
    if (end < 0.01) {
      EXPECT_GT(fit.failed_starts, 0u);
    } else {
      EXPECT_LT(fit.minima.back().numbers, 20);
      EXPECT_LT(fit.minima.back().chi_square, 0.1 * fit.minima[0].chi_square);
    }
  }
}

TEST(LogFit, AcceptsTheFreeBiasOfAnOrientation) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const double s = 2e-3, bias = 0.05;
  Quantities log = measured({}, {}, 3);
  ComparedQuantity& q = log[0];
  const auto turned = [](const Joint& joint) {
    std::vector<double> time, values;
    for (int k = 0; k <= 1200; ++k) {
      time.push_back(0.01 * k);
      const double half = joint.state(time.back())[0] / 2;
      for (const double x : {std::cos(half), 0.0, 0.0, std::sin(half)}) values.push_back(x);
    }
    return RunCurve(time, values, 4);
  };
  q.curve = turned({}), q.is_orientation = true, q.components = {"x", "y", "z"};
  q.uncertainty = s, q.bias_uncertainty = std::numeric_limits<double>::infinity(), q.measured.clear();
  for (const double t : q.time) {
    const double half = (Joint{}.state(t)[0] + bias + s * normal(random)) / 2, a = s / 2 * normal(random),
                 b = s / 2 * normal(random), c = std::cos(half), d = std::sin(half), norm = std::hypot(1, a, b);
    for (const double x : {c, a * c + b * d, b * c - a * d, d}) q.measured.push_back(x / norm);
  }
  LogFitProblem problem = problem_of(log);
  problem.logs[0].simulate = [log, turned](std::span<const double> v, const std::stop_token&) {
    Quantities now = log;
    now[0].curve = turned(three(v)), now[1].curve = curve_of(three(v), 1);
    return now;
  };
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.agrees, Verdict::yes) << fit.reason;
  ASSERT_EQ(fit.logs[0].biases.size(), 3u);
  EXPECT_NEAR(fit.logs[0].biases[2].value, bias, 5 * fit.logs[0].biases[2].uncertainty);
}

TEST(LogFit, StatesThatAClockIsAtAnEndOfItsSearch) {
  LogFitProblem problem = problem_of(measured({}, {}, 1));
  problem.logs[0].fits_offset = true;
  problem.logs[0].offset_range = {-0.5, 0.5};
  const LogFit inside = fit_logs(problem, {});
  ASSERT_EQ(inside.agrees, Verdict::yes) << inside.reason;
  // The range ends within the uncertainty, so that the fit is as good.
  problem.logs[0].offset_range = {-0.5, inside.logs[0].clock.offset - 0.3 * *inside.logs[0].offset_uncertainty};
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.logs[0].clock.offset, (*problem.logs[0].offset_range)[1]);
  EXPECT_EQ(fit.agrees, Verdict::not_checked) << fit.reason;
  EXPECT_FALSE(fit.logs[0].offset_uncertainty);
  EXPECT_FALSE(fit.parameters[0].interval);
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("is at an end of its search")));
}

// A log of a number that is a function of a parameter.
LogFitProblem number_of(const std::function<double(double)>& f, double start, double tolerance) {
  LogFitProblem problem = problem_of(measured({}, {}, 1));
  problem.parameters = {{"p", "", 0, 1, start, false, {}}};
  problem.settings.tolerance = tolerance;
  Quantities log = measured({}, {}, 1);
  log.pop_back();
  problem.logs[0].simulate = [log, f](std::span<const double> v, const std::stop_token&) {
    Quantities now = log;
    const double y = f(v[0]);
    now[0].curve = {{0, 4, 8, 12}, {y, y, y, y}, 1};
    return now;
  };
  return problem;
}

// The refined derivative by the parameter, per derivative of f.
double refined_derivative(const LogFitProblem& problem, double slope) {
  const FitOptions options;
  LogFitter fitter(problem, {0}, options);
  Eigen::VectorXd x(1);
  x[0] = problem.parameters[0].start;
  const Selection all = selected_samples(problem.logs[0], *fitter.run(x)[0], {});
  fitter.set_selection({all}, {0});
  const auto d = fitter.derivatives(x, true);
  const double n = static_cast<double>(std::count(all[0].begin(), all[0].end(), true)), s = 2e-3;
  return d->white.norm() * s / std::sqrt(n) / std::abs(slope);
}

TEST(LogFit, RefinesDerivativesBesideBounds) {
  const auto f = [](double p) { return std::exp(3 * p); };
  for (const double p : {0.5, 0.999, 1.0})  // measured 1e-10, 6e-8, 7e-5
    EXPECT_NEAR(refined_derivative(number_of(f, p, 1e-6), 3 * f(p)), 1, 7e-4) << p;
}

TEST(LogFit, RefinesDerivativesThatStillCurve) {
  // Steps of 0.05 shrink to 0.05 / 64 where the phase changes by 0.5 and the function still curves.
  const double K = 640, phase = std::atan(1.0) - K / 2;
  const auto f = [&](double p) { return std::sin(K * p + phase); };
  EXPECT_NEAR(refined_derivative(number_of(f, 0.5, 1e-3), K * std::cos(K / 2 + phase)), 1, 1.5e-3);  // measured 1.3e-4
}

TEST(LogFit, DoesNotCountWhatOnlyTheLeftOutLogDetermines) {
  // Only the second log depends on the impulse.
  const JointModel first = [](std::span<const double> v) { return Joint{v[0], v[1], 1, 3}; };
  LogFitProblem problem = problem_of(measured({}, {}, 9), first);
  problem.logs.push_back(log_of(measured({}, {}, 10), three, "second"));
  const LogFit fit = fit_logs(problem, {});
  ASSERT_TRUE(fit.logs[0].left_out && fit.logs[1].left_out);
  EXPECT_EQ(fit.logs[0].left_out->numbers, fit.logs[0].chi_square.numbers);
  EXPECT_EQ(fit.logs[1].left_out->numbers, fit.logs[1].chi_square.numbers - 1);
  // One sample, after the impulse.
  Quantities one = measured({}, {}, 10);
  one[0].uncertainty.reset();
  one[1].time = {one[1].time[100]}, one[1].measured = {one[1].measured[100]};
  problem.logs[1] = log_of(one, three, "second");
  const LogFit none = fit_logs(problem, {});
  EXPECT_FALSE(none.logs[1].left_out);
  EXPECT_EQ(none.logs[1].why_not_left_out, "the fit without this log determines no value of it");
}

TEST(LogFit, AStopDuringTheCrossValidationKeepsTheFit) {
  LogFitProblem problem = problem_of(measured({}, {}, 9));
  problem.logs.push_back(log_of(measured({}, {}, 10), three, "second"));
  std::stop_source stop;
  FitOptions options{.stop = stop.get_token()};
  options.progress = [&](std::size_t start, std::size_t) {
    if (start == 0) stop.request_stop();
  };
  const LogFit fit = fit_logs(problem, options);
  EXPECT_FALSE(fit.stopped);
  EXPECT_TRUE(fit.stopped_validating);
  EXPECT_EQ(fit.agrees, Verdict::yes);
  EXPECT_EQ(fit.logs[1].why_not_left_out, "stopped");
  EXPECT_FALSE(fit_logs(problem, {}).stopped_validating);
}

TEST(LogFit, ComparesALogThatIsLeftOut) {
  Joint other;
  LogFitProblem problem = problem_of(measured({}, {}, 9));
  problem.logs.push_back(log_of(measured({}, {}, 10), three, "second"));
  problem.logs.push_back(log_of(measured({}, {}, 11), three, "third"));
  problem.logs[1].fits_offset = true;
  const LogFit fit = fit_logs(problem, {});
  EXPECT_EQ(fit.agrees, Verdict::yes);
  for (const LogEstimate& log : fit.logs) {
    ASSERT_TRUE(log.left_out) << log.why_not_left_out;
    EXPECT_TRUE(log.left_out->agrees()) << log.left_out->per_number();
    EXPECT_NEAR(log.left_out_values[0], 2, 0.05);
  }
  // Another joint in the third experiment.
  other.inertia = 2.4;
  problem.logs[2] = log_of(measured(other, {}, 11), three, "third");
  const LogFit wrong = fit_logs(problem, {});
  EXPECT_FALSE(wrong.logs[2].left_out->agrees());
  EXPECT_GT(wrong.logs[2].left_out->per_number(), 5 * wrong.logs[2].left_out->bound);
}

TEST(LogFit, IsIndependentOfThreadsAndStops) {
  LogFitProblem problem = problem_of(measured({}, {}, 12));
  problem.settings.starts = 3;
  const LogFit one = fit_logs(problem, {.threads = 1}), four = fit_logs(problem, {.threads = 4});
  EXPECT_EQ(one.best, four.best);
  EXPECT_EQ(one.covariance, four.covariance);
  std::stop_source stop;
  FitOptions options{.threads = 2, .stop = stop.get_token()};
  options.progress = [&](std::size_t, std::size_t evaluations) {
    if (evaluations == 3) stop.request_stop();
  };
  const LogFit stopped = fit_logs(problem, options);
  EXPECT_TRUE(stopped.stopped);
  EXPECT_EQ(stopped.evaluations.size(), 3u);
  EXPECT_EQ(stopped.best.size(), 3u);
}

}  // namespace log_fit_test
}  // namespace grapnel
