// Optimization of captures: known optima, limits, threads, and output files.
#include "grapnel/campaign/optimize.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/optimization_report.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace optimize_test {

using ::testing::HasSubstr;

const std::string kPlanned = test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml");

// One arm's angle, with the end-effector arriving at 0.1 m/s.
std::string angle_text(const std::string& more) {
  return "name: angle\nscenario: " + kPlanned +
         "\nsimulate: impact\nset: {approach.plan.starts: 1, 'grasps.tip-1.relative_velocity': [0, -0.1, 0]}\n"
         "variables: [{quantity: approach_angle, grasp: tip-1, from: -20, to: 40, unit: deg}]\n" +
         more;
}

Optimization loaded(const std::string& text) {
  const test::Folder folder;
  return load_optimization(folder.write("optimization.yaml", text));
}

OptimizationOutcome run(const Optimization& optimization, int threads = 2) {
  return optimize(optimization, {.threads = threads});
}

double best_objective(const OptimizationOutcome& outcome) {
  return outcome.best ? outcome.evaluations[*outcome.best].score.objective : NAN;
}

// An optimization of a known function instead of captures: `value` of the variables is the only column.
Optimization of_function(std::size_t dimensions, std::function<double(std::span<const double>)> value) {
  Optimization optimization;
  for (std::size_t k = 0; k < dimensions; ++k) optimization.variables.push_back({"x", "", -1, 2, 0.5});
  optimization.point = [value](std::span<const double> x) {
    StudyCase point{load_scenario(kPlanned), {}};
    point.problem.approach.reset();
    point.problem.post_impact.reset();
    point.problem.contact.gap = ContactSetup::Gap::weld_as_found;
    point.problem.contact.largest_gap = INFINITY;
    point.problem.targets[0].mass = 100 + value(x);
    return point;
  };
  optimization.columns.push_back(
      {"f", "1", "", [](const StudyCase& p, const CaptureResult&) { return p.problem.targets[0].mass - 100; }});
  optimization.columns.push_back(feasibility_column());
  optimization.objective = {{{"f", "1", {0}, Combine::largest}, 1}};
  optimization.mode = StudyMode::impact;
  optimization.before = optimization.point(std::vector<double>(dimensions, 0.0));
  return optimization;
}

TEST(Optimize, FindsTheMinimumOfAKnownFunction) {
  const auto bowl = [](std::span<const double> x) {
    return (x[0] - 0.3) * (x[0] - 0.3) + 2 * (x[1] + 0.4) * (x[1] + 0.4) + 0.5 * x[0] * x[1] + 3;
  };
  Optimization optimization = of_function(2, bowl);
  optimization.search = {300, 1, 2};
  const OptimizationOutcome outcome = run(optimization);
  ASSERT_TRUE(outcome.best);
  // Gradient zero: 2 (x - 0.3) + 0.5 y = 0, 4 (y + 0.4) + 0.5 x = 0.
  const double y = (-1.6 - 0.15) / (4 - 0.125), x = 0.3 - 0.25 * y;
  EXPECT_NEAR(outcome.evaluations[*outcome.best].values[0], x, 1e-4);
  EXPECT_NEAR(outcome.evaluations[*outcome.best].values[1], y, 1e-4);
  EXPECT_LE(outcome.evaluations.size(), 300u);
  optimization.maximize = true;
  const OptimizationOutcome other = run(optimization);
  EXPECT_NEAR(best_objective(other), bowl(std::vector{2.0, 2.0}), 1e-9);  // at a corner
}

// A valley along x y, whose sides are a hundred times as steep: derivatives follow it.
TEST(Optimize, GradientsFollowAValley) {
  const auto valley = [](std::span<const double> x) {
    const double along = x[0] + x[1] - 1, across = x[0] - x[1] - 0.2;
    return 3 + along * along + 100 * across * across;
  };
  Optimization optimization = of_function(2, valley);
  optimization.variables[0].start = -0.9, optimization.variables[1].start = 1.8;
  const auto excess = [&](LocalSteps steps, std::size_t evaluations) {
    optimization.search = {evaluations, 0, 1, steps};
    return best_objective(run(optimization)) - 3;
  };
  const double by_gradient = excess(LocalSteps::gradient, 80), by_points = excess(LocalSteps::subplex, 80);
  std::printf("[ measured ] above the minimum after 80 evaluations: %.3g by gradients, %.3g by comparisons\n",
              by_gradient, by_points);
  EXPECT_LT(by_gradient, 1e-9);
  EXPECT_GT(by_points, 1e-7);
}

TEST(Optimize, FindsTheAngleOfTheSweepsFineGrid) {
  const test::Folder folder;
  const std::string head = "name: grid\nscenario: " + kPlanned +
                           "\nsimulate: impact\nset: {approach.plan.starts: 1, 'grasps.tip-1.relative_velocity': "
                           "[0, -0.1, 0]}\n";
  const Campaign grid = load_study(
      folder.write("grid.yaml", head + "columns: [grasps/tip-1/angular_impulse_magnitude]\naxes: [{quantity: "
                                       "approach_angle, grasp: tip-1, from: -20, to: 40, count: 121, unit: deg}]\n"));
  double least = INFINITY, at = 0;
  for (const CaseRow& row : run_sweep(grid, {})) {
    if (row.status == CaseStatus::ok && row.values[0] < least)
      least = row.values[0], at = grid.design[0].values[row.index].number;
  }
  const OptimizationOutcome outcome = run(
      loaded(angle_text("minimize: grasps/tip-1/angular_impulse_magnitude\nsearch: {evaluations: 50, refine: 2}\n")));
  ASSERT_TRUE(outcome.best);
  RecordProperty("least", std::to_string(least));
  EXPECT_LE(best_objective(outcome), least + 1e-9);
  EXPECT_NEAR(outcome.evaluations[*outcome.best].values[0], at, 0.5 + 1e-9);  // the spacing of the grid
}

// x^2 + y^2 under x + y >= 1, a limit across both variables: 1/2 at (1/2, 1/2).
TEST(Optimize, LimitsAreRespectedAndHeldWhereTheyBind) {
  Optimization optimization = of_function(2, [](std::span<const double> x) { return x[0] * x[0] + x[1] * x[1]; });
  const auto function = optimization.point;
  optimization.point = [function](std::span<const double> x) {
    StudyCase point = function(x);
    point.problem.targets[1].mass = 100 + x[0] + x[1];
    return point;
  };
  optimization.columns.insert(
      optimization.columns.begin(),
      {"g", "1", "", [](const StudyCase& p, const CaptureResult&) { return p.problem.targets[1].mass - 100; }});
  optimization.objective[0].measured.columns = {1};
  optimization.limits = {{{"g", "1", {0}, Combine::least}, false, 1}};
  optimization.variables[0].start = optimization.variables[1].start = -0.5;
  optimization.search = {300, 0, 3};
  const OptimizationOutcome outcome = run(optimization);
  ASSERT_TRUE(outcome.best);
  const Score& best = outcome.evaluations[*outcome.best].score;
  EXPECT_GE(best.limits[0], 1);
  EXPECT_NEAR(best.objective, 0.5, 1e-3);
  EXPECT_GT(outcome.beyond_limits(), 0u);
  optimization.search = {100, 0, 1, LocalSteps::gradient};
  const OptimizationOutcome by_gradient = run(optimization);
  ASSERT_TRUE(by_gradient.best);
  const Score& found = by_gradient.evaluations[*by_gradient.best].score;
  EXPECT_GE(found.limits[0], 1);
  EXPECT_NEAR(found.objective, 0.5, 1e-6);
}

// The larger of two planes, whose kink gradients alone do not descend.
TEST(Optimize, ComparisonsFollowGradientsAtAKink) {
  Optimization optimization =
      of_function(2, [](std::span<const double> x) { return 3 + std::abs(x[0] - 0.4) + 2 * std::abs(x[1] - x[0]); });
  optimization.search = {400, 0, 2, LocalSteps::gradient};
  EXPECT_LT(best_objective(run(optimization)) - 3, 1e-3);
}

// Unreachable points beside a point: the derivative is that of the other side.
TEST(Optimize, GradientsAtUnreachablePoints) {
  Optimization optimization = of_function(1, [](std::span<const double> x) { return 3 + x[0]; });
  const auto function = optimization.point;
  optimization.point = [function](std::span<const double> x) {
    if (x[0] < 0.2) throw std::runtime_error("out of reach");
    return function(x);
  };
  optimization.search = {60, 0, 1, LocalSteps::gradient};
  const OptimizationOutcome outcome = run(optimization);
  EXPECT_NEAR(best_objective(outcome), 3.2, 0.02);  // measured 0.006; the range is 3
  EXPECT_GT(outcome.count(CaseStatus::failed), 0u);
}

TEST(Optimize, TheSameBitsForAnyNumberOfThreads) {
  Optimization optimization =
      loaded(angle_text("minimize: grasps/tip-1/impulse_magnitude\nsearch: {evaluations: 20, refine: 3}\n"));
  optimization.search.steps = LocalSteps::gradient;
  EXPECT_EQ(evaluations_csv(optimization, run(optimization, 1)), evaluations_csv(optimization, run(optimization, 2)));
  optimization.search.steps = LocalSteps::subplex;
  const std::string one = evaluations_csv(optimization, run(optimization, 1));
  EXPECT_EQ(one, evaluations_csv(optimization, run(optimization, 2)));
  EXPECT_EQ(one, evaluations_csv(optimization, run(optimization, 5)));
  Optimization other = optimization;
  other.search.seed = 7;
  EXPECT_NE(one, evaluations_csv(other, run(other, 2)));
}

// An impact without motion has no feasibility checks: the verdict is unknown, and the text omits it.
TEST(Optimize, ReportsUncheckedFeasibility) {
  const Optimization optimization =
      loaded(angle_text("minimize: grasps/tip-1/impulse_magnitude\nsearch: {evaluations: 6, refine: 1}\n"));
  const OptimizationOutcome outcome = run(optimization);
  ASSERT_TRUE(outcome.best);
  const Evaluation& best = outcome.evaluations[*outcome.best];
  EXPECT_THAT(comparison_text(optimization, outcome, &best),
              HasSubstr("\nfeasible: before not checked, after not checked\n"));
  const nlohmann::json written = nlohmann::json::parse(comparison_json(optimization, outcome, &best, ""));
  EXPECT_EQ(written["feasibility"]["after"], "not checked");
  EXPECT_THAT(test::contract_faults<OptimizationReport>(written), ::testing::IsEmpty());
}

TEST(Optimize, WithoutAcceptablePointNamesTheNearestLimit) {
  const Optimization optimization =
      loaded(angle_text("minimize: grasps/tip-1/impulse_magnitude\nsearch: {evaluations: 10, refine: 1}\n"
                        "limits:\n  - {column: kinetic_energy_before, at_least: 0}\n"
                        "  - {column: grasps/tip-1/impulse_magnitude, at_most: 1e-3}\n"));
  const OptimizationOutcome outcome = run(optimization);
  EXPECT_FALSE(outcome.best);
  ASSERT_TRUE(outcome.nearest);
  const nlohmann::json written = nlohmann::json::parse(comparison_json(optimization, outcome, nullptr, ""));
  EXPECT_EQ(written["best"], nullptr);
  EXPECT_THAT(test::contract_faults<OptimizationReport>(written), ::testing::IsEmpty());
  EXPECT_EQ(outcome.beyond_limits(), outcome.count(CaseStatus::ok));
  EXPECT_THAT(why_nothing_is_best(optimization, outcome),
              HasSubstr("the limit 'grasps/tip-1/impulse_magnitude at most 0.001' is violated, with "));
}

TEST(Optimize, PointsOutOfReachAreCountedAndChangeNothing) {
  Optimization optimization =
      loaded(angle_text("minimize: grasps/tip-1/impulse_magnitude\nsearch: {evaluations: 12, refine: 1}\n"));
  optimization.variables[0].from = 100;  // no valid configuration there
  optimization.variables[0].to = 140;
  const OptimizationOutcome outcome = run(optimization);
  EXPECT_EQ(outcome.count(CaseStatus::unreachable), outcome.evaluations.size());
  EXPECT_FALSE(outcome.best || outcome.nearest);
  EXPECT_THAT(why_nothing_is_best(optimization, outcome), HasSubstr("no point has a result, most frequent reason"));
}

// Larger steps lose more energy: the point with the minimum is the least accurate.
TEST(Optimize, APointThatBreaksConservationNeverWins) {
  const Optimization optimization =
      loaded("schema: grapnel-optimization/1\nname: steps\nscenario: " +
             test::shipped("scenarios/thesis/open-loop-case-1-planned.yaml") +
             "\nset: {integration.method: rk4, integration.step: 0.05, contact: {gap: weld_as_found}}\nminimize: "
             "end/base/angular_velocity/z\nfeasible: false\n"
             "variables:\n  - {path: integration.step, from: 0.05, to: 3}\nsearch: {evaluations: 6, refine: 0}\n");
  const OptimizationOutcome outcome = run(optimization);
  EXPECT_GT(outcome.count(CaseStatus::failed), 2u);
  ASSERT_TRUE(outcome.best);
  EXPECT_EQ(outcome.evaluations[*outcome.best].row.status, CaseStatus::ok);
  for (const Evaluation& one : outcome.evaluations) {
    if (one.row.status == CaseStatus::ok) continue;
    EXPECT_THAT(one.row.reason, HasSubstr("conservation check failed: "));
    EXPECT_FALSE(one.score.reached || one.score.acceptable());
    EXPECT_TRUE(std::isnan(one.score.objective));
  }
}

// Deb's rules, on given scores.
TEST(Optimize, AcceptablePointsComeFirst) {
  Optimization optimization;
  Score good{true, 5, {}, 0, 0}, better{true, 4, {}, 0, 0}, beyond{true, 1, {}, 0.1, 0}, far{true, 0, {}, 2, 0}, none;
  const Score* order[] = {&better, &good, &beyond, &far, &none};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) EXPECT_EQ(comes_before(optimization, *order[i], *order[j]), i < j) << i << j;
  }
  optimization.maximize = true;
  EXPECT_TRUE(comes_before(optimization, good, better));
}

TEST(Optimize, ColumnsCombine) {
  const std::vector<double> row{3, -4, 1, NAN};
  const auto value = [&](Combine combine, std::vector<std::size_t> columns = {0, 1, 2}) {
    return value_of({"", "", std::move(columns), combine}, row);
  };
  EXPECT_EQ(value(Combine::largest), 3);
  EXPECT_EQ(value(Combine::least), -4);
  EXPECT_EQ(value(Combine::largest_magnitude), 4);
  EXPECT_EQ(value(Combine::sum), 0);
  EXPECT_DOUBLE_EQ(value(Combine::norm), std::sqrt(26.0));
  EXPECT_TRUE(std::isnan(value(Combine::largest, {0, 3})));
}

// All kinds of variables together; the written file equals the point, bit for bit without rotations.
TEST(Optimize, TheWrittenScenarioIsThePoint) {
  const Optimization optimization =
      loaded("name: all\nscenario: " + test::shipped("scenarios/thesis/closed-loop.yaml") +
             "\nsimulate: impact\nset: {approach.plan.starts: 2, robot.base.mass: 400}\nminimize: "
             "base/angular_velocity_change\n"
             "variables:\n"
             "  - {path: approach.duration, from: 15, to: 30}\n"
             "  - {quantity: approach_angle, grasp: tip-1, from: -10, to: 20, unit: deg}\n"
             "  - {quantity: relative_speed, grasp: tip-2, from: 0.01, to: 0.05}\n"
             "  - {quantity: target_spin, from: 0.1, to: 0.3}\n"
             "  - {quantity: mass_ratio, from: 0.01, to: 0.1}\n"
             "  - {patch: sphere.left, u: [0, 1, 0], v: [0, 0, 1], half_widths: [0.05, 1e-9]}\n"
             "search: {evaluations: 1}\n");
  ASSERT_EQ(optimization.variables.size(), 7u);
  EXPECT_EQ(optimization.variables[0].start, 20);  // as in the scenario
  EXPECT_EQ(optimization.variables[6].name, "sphere.left/v");
  const std::vector<double> values{17.5, 7.3, 0.0213, 0.17, 0.031, 0.0123, 0};
  const Evaluation found = evaluate(optimization, optimization.point(values));
  ASSERT_TRUE(found.score.reached) << found.row.reason;
  EXPECT_GT(std::abs(found.score.objective - evaluate(optimization, optimization.before).score.objective), 1e-6);
  const test::Folder folder;
  const auto file = folder.write("best.yaml", optimization.scenario_text(values, folder.path() / "best.yaml", "x"));
  const CaptureProblem written = load_scenario(file);
  EXPECT_EQ(written.approach->duration, 17.5);
  EXPECT_EQ(written.robot.bodies[0].mass, 400);
  const Evaluation again = evaluate(optimization, {written, inward_normals(written)});
  for (std::size_t c = 0; c < optimization.columns.size(); ++c) {
    const double a = found.row.values[c], b = again.row.values[c];
    EXPECT_TRUE((std::isnan(a) && std::isnan(b)) || std::abs(a - b) <= 1e-9) << optimization.columns[c].name;
  }
}

}  // namespace optimize_test
}  // namespace grapnel
