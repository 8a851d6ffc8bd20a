// Many draws of logs: errors of the fit in units of its covariance.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fit/joint_experiment.hpp"
#include "fit/slider_experiment.hpp"
#include "grapnel/compare/identification.hpp"

namespace grapnel {
namespace slow_draws_test {

using namespace joint_experiment;

TEST(IdentificationDraws, IntervalsContainTheTruthInNinetyFivePercentOfDraws) { check_draws(500); }

// The expected chi-square of a log that is left out counts the uncertainty of the fit to the others.
TEST(IdentificationDraws, CountTheUncertaintyOfThePrediction) {
  const int draws = 80;
  double sum = 0, numbers = 0;
  for (int draw = 0; draw < draws; ++draw) {
    Quantities precise = measured({}, {}, 2000u + static_cast<unsigned>(draw)), coarse;
    Sensors sensors;
    sensors.encoder = 0.02, sensors.gyro = 0.05;
    coarse = measured({}, sensors, 4000u + static_cast<unsigned>(draw));
    LogFitProblem problem = problem_of(coarse);
    problem.logs.push_back(log_of(precise, three, "precise"));
    const LogFit fit = fit_logs(problem, {});
    ASSERT_TRUE(fit.logs[1].left_out);
    sum += fit.logs[1].left_out->value, numbers += fit.logs[1].left_out->numbers;
  }
  EXPECT_NEAR(sum, numbers, 5 * std::sqrt(2 * numbers)) << sum / numbers;  // measured 1.00
}

TEST(IdentificationDraws, ErrorsHaveTheStatedCovariance) {
  const test::ExperimentFolder folder;
  const auto scenario = folder.write("slider.yaml", test::kSlider);
  folder.write("map.yaml", test::kSliderMap);
  const auto study = folder.write("study.yaml", R"(name: slider
scenario: slider.yaml
parameters:
  - {path: targets.block.mass, from: 2, to: 8}
  - {path: robot.links.platform.joint.friction.coulomb, from: 0.01, to: 0.2}
logs:
  - {log: log.csv, map: map.yaml}
search: {starts: 1}
)");
  const int draws = 500;
  double normalized = 0;
  int inside = 0, agreed = 0;
  for (int draw = 0; draw < draws; ++draw) {
    folder.write("log.csv",
                 test::slider_log(scenario, {{"targets.block.mass", "5"}}, 10 + static_cast<unsigned>(draw)));
    const Identification identification = load_identification(study);
    const LogFit fit = fit_logs(identification.problem, {.threads = 2});
    ASSERT_EQ(fit.covariance.rows(), 2) << draw;
    const Eigen::Vector2d error(fit.best[0] - 5, fit.best[1] - 0.05);
    normalized += error.dot(Eigen::Matrix2d(fit.covariance).inverse() * error);
    inside += std::abs(error[0]) < 1.96 * std::sqrt(fit.covariance(0, 0)) ? 1 : 0;
    agreed += fit.agrees == Verdict::yes ? 1 : 0;
  }
  EXPECT_NEAR(normalized / draws, 2, 5 * std::sqrt(4.0 / draws));
  EXPECT_NEAR(inside, 0.95 * draws, 4.5 * std::sqrt(draws * 0.95 * 0.05));
  EXPECT_GT(agreed, 0.95 * draws);
}

}  // namespace slow_draws_test
}  // namespace grapnel
