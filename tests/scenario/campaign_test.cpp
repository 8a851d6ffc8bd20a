#include "grapnel/study_files/study_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/capture_window.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/study/case_pool.hpp"
#include "grapnel/text/faults.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace campaign_test {

std::string shipped(const std::string& name) { return std::string(GRAPNEL_SOURCE_DIR "/") + name; }

std::string head(const std::string& scenario = "scenarios/thesis/open-loop-case-1-planned.yaml") {
  return "schema: grapnel-campaign/1\nname: test\nscenario: " + shipped(scenario) + "\ncases: 1000\nseed: 5\n";
}

Campaign load(const test::TemporaryFolder& folder, const std::string& text) {
  try {
    return load_campaign(folder.write("campaign.yaml", text));
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults()) ADD_FAILURE() << fault.text();
    throw;
  }
}

// What a campaign's text of a case reads back as.
CaptureProblem read_back(const test::TemporaryFolder& folder, const Campaign& campaign, std::uint64_t k) {
  const auto place = folder.path() / "case.yaml";
  return load_scenario(folder.write("case.yaml", campaign.scenario_text(k, place, "a comment")));
}

// The problem by the quick way is the one that its own scenario file gives, to the last bit.
void expect_read_back(const std::string& text, std::uint64_t cases = 5) {
  const test::TemporaryFolder folder;
  const Campaign campaign = load(folder, text);
  std::string before;
  for (std::uint64_t k = 0; k < cases; ++k) {
    CaptureProblem problem = campaign.problem(k).problem;
    const CaptureProblem read = read_back(folder, campaign, k);
    EXPECT_EQ(read.name, problem.name + ", case " + std::to_string(k));
    problem.name = read.name;
    EXPECT_TRUE(problem_bytes(problem) == problem_bytes(read)) << "case " << k;
    EXPECT_FALSE(problem_bytes(problem) == before);
    before = problem_bytes(problem);
  }
}

TEST(Campaign, DrawsTheDistributionsOfTheFile) {
  const test::TemporaryFolder folder;
  const Campaign campaign =
      load(folder, head() +
                       "sampling: latin_hypercube\n"
                       "uncertain:\n"
                       "  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.8, to: 1.2}}\n"
                       "  - {path: targets.target-1.com, as: offset, normal: {deviation: [0.1, 0, 0.2]}}\n");
  ASSERT_EQ(campaign.inputs.size(), 3u);
  EXPECT_EQ(campaign.inputs[0].name, "targets.target-1.mass");
  EXPECT_EQ(campaign.inputs[0].unit, "kg");
  EXPECT_EQ(campaign.inputs[1].name, "targets.target-1.com/x");
  EXPECT_EQ(campaign.inputs[2].name, "targets.target-1.com/z");
  EXPECT_EQ(campaign.inputs[2].unit, "m");
  double sum = 0, least = 100, largest = 0;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    const double mass = campaign.draw(k)[0];
    sum += mass, least = std::min(least, mass), largest = std::max(largest, mass);
  }
  EXPECT_NEAR(sum / 1000, 10, 1e-3);  // stratified
  EXPECT_TRUE(least >= 8 && least < 8.01);
  EXPECT_TRUE(largest <= 12 && largest > 11.99);
  const StudyCase one = campaign.problem(17);
  const auto numbers = campaign.draw(17);
  EXPECT_EQ(one.problem.targets[0].mass, numbers[0]);
  EXPECT_EQ(one.problem.targets[0].com[0], numbers[1]);
  EXPECT_EQ(one.problem.targets[0].com[1], 0);
  EXPECT_EQ(one.problem.targets[1].mass, 10);
  EXPECT_EQ(one.inward_normals.size(), 2u);
  EXPECT_EQ(campaign.success.size(), 1u);  // captured
  EXPECT_EQ(campaign.success[0].text(), "captured");
}

TEST(Campaign, ACaseIsAFunctionOfItsNumber) {
  const test::TemporaryFolder folder;
  for (const std::string sampling : {"random", "latin_hypercube", "sobol"}) {
    const std::string text = head() + "sampling: " + sampling +
                             "\nuncertain:\n  - {path: targets.target-1.mass, uniform: {from: 8, to: 12}}\n";
    const Campaign one = load(folder, text), two = load(folder, text);
    std::vector<double> forward;
    constexpr std::uint64_t kDrawn = test::repetitions(50);
    for (std::uint64_t k = 0; k < kDrawn; ++k) forward.push_back(one.draw(k)[0]);
    for (std::uint64_t k = kDrawn; k-- > 0;) EXPECT_EQ(two.draw(k)[0], forward[k]);
    EXPECT_EQ(one.sha256, two.sha256);
    EXPECT_NO_THROW(one.problem(123456));  // beyond the file's: an extended campaign
  }
}

TEST(Campaign, ThePlanIsMadeOnce) {
  const test::TemporaryFolder folder;
  const std::string uncertain =
      "uncertain:\n  - {path: 'targets.target-1.state.angular_velocity[2]', uniform: {from: 0.1, to: 0.3}}\n";
  const Campaign once = load(folder, head() + uncertain), anew = load(folder, head() + "plan: per_case\n" + uncertain);
  const CaptureProblem nominal = load_scenario(shipped("scenarios/thesis/open-loop-case-1-planned.yaml"));
  const ApproachPlan plan = plan_approach(nominal, plan_targets(nominal));
  for (const std::uint64_t k : {0u, 7u}) {
    const CaptureProblem frozen = once.problem(k).problem;
    EXPECT_FALSE(frozen.approach->plan);
    EXPECT_FALSE(frozen.approach->match);
    EXPECT_EQ(frozen.approach->final_position, plan.report.final_position);
    EXPECT_EQ(*frozen.approach->final_rates, plan.report.final_rates);
    EXPECT_TRUE(anew.problem(k).problem.approach->plan);
  }
  EXPECT_EQ(once.plan, CampaignPlan::nominal);
  EXPECT_EQ(anew.plan, CampaignPlan::per_case);
}

// With it the time of capture is chosen once, and stated from then on.
TEST(Campaign, TheTimeOfCaptureIsChosenOnce) {
  SKIP_UNDER_SANITIZERS();
  const test::TemporaryFolder folder;
  const std::string text =
      head() +
      "set: {approach: {window: {earliest: 10, latest: 20, step: 2.5, choose: slowest}, profile: quintic, plan: "
      "{}}, targets.target-1.state.velocity: [0, 0.001, 0]}\n"
      "uncertain:\n  - {path: 'targets.target-1.mass', uniform: {from: 9, to: 11}}\n";
  const Campaign once = load(folder, text), anew = load(folder, text + "plan: per_case\n");
  const CaptureProblem open = anew.problem(0).problem;
  ASSERT_TRUE(open.approach->window);
  const CaptureTime chosen = choose_capture_time(open);
  ASSERT_EQ(chosen.failure, "");
  const CaptureProblem stated = once.problem(0).problem;
  EXPECT_FALSE(stated.approach->window);
  EXPECT_FALSE(stated.approach->plan);
  EXPECT_EQ(stated.approach->duration, chosen.window.time);
  const ApproachPlan plan = plan_approach(chosen.problem, plan_targets(chosen.problem));
  EXPECT_EQ(stated.approach->final_position, plan.report.final_position);
}

// The frozen plan is the same approach: where nothing differs from what was planned for, the run is the same.
// Returns the largest difference, relative to values above 1.
double difference_of_plans(const std::string& text) {
  const test::TemporaryFolder folder;
  const Campaign once = load(folder, text), anew = load(folder, text + "plan: per_case\n");
  EXPECT_FALSE(once.problem(0).problem.approach->plan);
  const CaseRow a = run_case(once.problem(0), once.mode, once.columns),
                b = run_case(anew.problem(0), anew.mode, anew.columns);
  EXPECT_EQ(a.status, CaseStatus::ok) << a.reason;
  EXPECT_EQ(b.status, CaseStatus::ok) << b.reason;
  EXPECT_EQ(a.values.size(), b.values.size());
  double difference = 0, largest = 0;
  for (std::size_t c = 0; c < a.values.size(); ++c) {
    if (std::isnan(b.values[c])) continue;
    difference = std::max(difference, std::abs(a.values[c] - b.values[c]) / std::max(1.0, std::abs(b.values[c])));
    largest = std::max(largest, std::abs(b.values[c]));
  }
  EXPECT_GT(largest, 0.1);
  return difference;
}

TEST(Campaign, AFrozenPlanFliesTheSame) {
  EXPECT_LT(difference_of_plans(head() + "simulate: impact\nuncertain:\n"
                                         "  - {path: targets.target-1.mass, discrete: {values: [10]}}\n"),
            1e-10);
}

// One that goes straight in becomes pieces.
TEST(Campaign, FrozenStraightInApproachGivesTheSameMotion) {
  SKIP_UNDER_SANITIZERS();
  for (const std::string profile : {"quartic", "quintic", "cycloidal"}) {
    const double difference = difference_of_plans(
        head("scenarios/heavy-satellite-detumble.yaml") + "simulate: impact\nset: {approach.profile: " + profile +
        "}\nuncertain:\n  - {path: robot.base.mass, discrete: {values: [2400]}}\n");
    EXPECT_LT(difference, 1e-10) << profile;  // measured below
    std::printf("[ measured ] %s: %.2g\n", profile.c_str(), difference);
  }
}

TEST(Campaign, StraightInApproachIsPlannedOnce) {
  const std::string text = head("scenarios/heavy-satellite-detumble.yaml") +
                           "simulate: impact\nuncertain:\n"
                           "  - {path: targets.satellite.mass, as: factor, normal: {deviation: 0.1}}\n"
                           "  - {path: targets.satellite.state.angular_velocity, tilt: {deviation: 0.05}}\n"
                           "  - {path: approach.tracking.noise.seed, integers: {}}\n";
  expect_read_back(text);
  const test::TemporaryFolder folder;
  const Campaign campaign = load(folder, text);
  const ApproachSetup first = *campaign.problem(0).problem.approach;
  EXPECT_EQ(first.pieces.back().until, 60);
  EXPECT_FALSE(first.straight_in);
  const std::vector<CaseRow> rows = block_work(campaign)(block_at(0, 3, 3), {});  // in lanes
  for (std::uint64_t k = 0; k < 3; ++k) {
    const StudyCase one = campaign.problem(k);
    EXPECT_EQ(one.problem.approach->pieces[1].series, first.pieces[1].series);
    const CaseRow row = run_case(one, campaign.mode, campaign.columns);
    EXPECT_EQ(row.status, CaseStatus::ok) << row.reason;
    ASSERT_EQ(rows.at(k).values.size(), row.values.size());
    for (std::size_t c = 0; c < row.values.size(); ++c) {
      if (std::isnan(row.values[c])) continue;
      EXPECT_NEAR(rows[k].values[c], row.values[c], 1e-10);  // measured 9e-14
    }
  }
}

TEST(Campaign, SettersMatchTheReader) {
  const std::string tracking =
      "set: {approach.tracking: {mode: pd, kp: 49, kd: 14, noise: {position: 1e-3, seed: 0}}}\n";
  const std::string all =
      "uncertain:\n"
      "  - {path: targets.target-1.mass, as: factor, normal: {deviation: 0.1}}\n"
      "  - {path: targets.target-2.com, as: offset, normal: {deviation: 0.01}}\n"
      "  - {path: targets.target-1.inertia, as: factor, uniform: {from: 0.9, to: 1.1}, together: true}\n"
      "  - {path: 'targets.target-2.inertia[1]', uniform: {from: 0.9, to: 1.1}}\n"
      "  - {path: targets.target-1.state, rotation: {deviation: 0.1}}\n"
      "  - {path: targets.target-2.state, rotation: uniform}\n"
      "  - {path: targets.target-1.state.position, as: offset, normal: {deviation: 0.01}}\n"
      "  - {path: targets.target-1.state.velocity, sphere: {length: {uniform: {from: 0, to: 0.01}}}}\n"
      "  - {path: targets.target-1.state.angular_velocity, tilt: {deviation: 0.1, factor: {normal: {mean: 1, "
      "deviation: 0.1}}}}\n"
      "  - {path: targets.target-2.grasp_points.grip.position, as: offset, normal: {deviation: [0.01, 0.01, 0]}}\n"
      "  - {path: approach.tracking.noise.seed, integers: {}}\n"
      "  - {path: approach.tracking.noise.position, log_normal: {median: 1e-3, deviation: 0.2}}\n"
      "  - {path: approach.tracking.kp, as: factor, uniform: {from: 0.9, to: 1.1}}\n"
      "  - {path: initial.joints, as: offset, normal: {deviation: 1e-3}}\n"
      "  - {path: approach.final_joints, as: offset, normal: {deviation: 1e-3}}\n"
      "  - {path: initial.base.angular_velocity, normal: {mean: 0, deviation: [0, 0, 1e-4]}}\n"
      "  - {path: robot.base.mass, as: factor, uniform: {from: 0.9, to: 1.1}}\n"
      "  - {path: robot.links.arm-1-link-2.inertia, as: factor, uniform: {from: 0.9, to: 1.1}, together: true}\n"
      "  - {path: impact.duration, discrete: {values: [1e-3, 2e-3], weights: [1, 2]}}\n"
      "  - {path: integration.relative_tolerance, discrete: {values: [1e-9, 1e-10]}}\n";
  expect_read_back(head() + tracking + all);
  expect_read_back(head() + "plan: per_case\n" + tracking +
                   "uncertain:\n  - {path: targets.target-1.mass, as: factor, normal: {deviation: 0.1}}\n");
}

// Values without a setter are read again, with the same cases.
TEST(Campaign, EveryPathWorks) {
  expect_read_back(head() +
                       "uncertain:\n"
                       "  - {path: approach.duration, uniform: {from: 19, to: 21}}\n"
                       "  - {path: contact, discrete: {values: [{gap: weld_as_found}, {gap: translate_target}]}}\n"
                       "  - {path: robot.end_effectors.tip-1.position, as: offset, normal: {deviation: 1e-3}}\n"
                       "  - {path: targets.target-1.mass, normal: {mean: 10, deviation: 1}}\n",
                   3);
}

// A joint's value is in rad or in m, whichever it is.
TEST(Campaign, UnitsOfJoints) {
  const test::TemporaryFolder folder;
  const auto units = [&](const std::string& joints, const std::string& uncertain, const std::string& type) {
    const std::string scenario = test::edited(
        test::kSmallScenario,
        {{"shoulder, type: revolute", "shoulder, type: " + type},
         {"final_joints: [0.2, -0.4]", "final_joints: " + joints + "\n  tracking: {mode: pd, kp: 49, kd: 14}"},
         {"final_rates: {match: velocity}", "final_rates: {shoulder: 0.1, elbow: 0.2}"}});
    folder.write("scenario.yaml", scenario);
    const Campaign campaign =
        load(folder, "name: test\nscenario: scenario.yaml\ncases: 10\nuncertain:\n  - " + uncertain);
    std::vector<std::string> all;
    for (const CampaignInput& input : campaign.inputs) all.push_back(input.unit);
    return all;
  };
  using testing::ElementsAre;
  const std::string list = "[0.2, -0.4]", mapping = "{elbow: -0.4, shoulder: 0.2}",
                    all = "{path: approach.final_joints, as: offset, normal: {deviation: 1e-3}}",
                    together = "{path: approach.final_joints, as: offset, together: true, normal: {deviation: 1e-3}}";
  EXPECT_THAT(units(list, all, "prismatic"), ElementsAre("m", "rad"));
  EXPECT_THAT(units(mapping, all, "prismatic"), ElementsAre("rad", "m"));
  EXPECT_THAT(units(list, "{path: 'approach.final_joints[0]', uniform: {from: 0, to: 1}}", "prismatic"),
              ElementsAre("m"));
  EXPECT_THAT(units(list, "{path: approach.final_rates.elbow, uniform: {from: 0, to: 0.1}}", "prismatic"),
              ElementsAre("rad/s"));
  EXPECT_THAT(units(list, "{path: approach.tracking.kp, uniform: {from: 40, to: 50}}", "prismatic"),
              ElementsAre("N m/rad or N/m; for computed_torque 1/s^2"));
  EXPECT_THAT(units(list, together, "prismatic"), ElementsAre("rad or m"));
  EXPECT_THAT(units(list, together, "revolute"), ElementsAre("rad"));
  EXPECT_THAT(units(list, "{path: approach.tracking.noise.position, uniform: {from: 0, to: 1e-3}}", "revolute"),
              ElementsAre("rad"));
}

TEST(Campaign, CovarianceOfSeveralPaths) {
  const test::TemporaryFolder folder;
  const Campaign campaign = load(folder, head() +
                                             "uncertain:\n"
                                             "  - paths: [targets.target-1.mass, 'targets.target-1.com[0]']\n"
                                             "    as: offset\n"
                                             "    normal: {covariance: [[1, 0.09], [0.09, 0.01]]}\n");
  ASSERT_EQ(campaign.inputs.size(), 2u);
  EXPECT_EQ(campaign.inputs[1].name, "targets.target-1.com[0]");
  double xx = 0, xy = 0, yy = 0;
  constexpr int kCases = 4000;
  for (std::uint64_t k = 0; k < kCases; ++k) {
    const auto x = campaign.draw(k);
    xx += (x[0] - 10) * (x[0] - 10), xy += (x[0] - 10) * x[1], yy += x[1] * x[1];
  }
  EXPECT_NEAR(xx / kCases, 1, 0.1);
  EXPECT_NEAR(yy / kCases, 0.01, 0.001);
  EXPECT_NEAR(xy / kCases, 0.09, 0.009);
  EXPECT_EQ(campaign.problem(3).problem.targets[0].com[0], campaign.draw(3)[1]);
}

TEST(Campaign, ADesignHasTheSameSampleAtAllItsPoints) {
  const test::TemporaryFolder folder;
  const Campaign campaign =
      load(folder, head() +
                       "uncertain:\n  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.8, to: 1.2}}\n"
                       "design:\n"
                       "  - {quantity: target_spin, target: target-1, from: 0.1, to: 0.3, count: 3}\n"
                       "  - {path: targets.target-1.mass, values: [10, 20]}\n");
  EXPECT_EQ(campaign.total(), 6000u);
  for (std::uint64_t point = 0; point < 6; ++point) {
    const CaptureProblem problem = campaign.problem(point * 1000 + 4).problem;
    EXPECT_DOUBLE_EQ(problem.targets[0].V_WT.angular[2], 0.1 + 0.1 * static_cast<double>(point / 2));
    EXPECT_DOUBLE_EQ(problem.targets[0].mass, campaign.draw(4)[0] * (point % 2 == 0 ? 1 : 2));
    EXPECT_EQ(problem.targets[0].mass, campaign.draw(point * 1000 + 4)[0]);
  }
  // Each point of the design has a separate plan.
  EXPECT_NE(*campaign.problem(0).problem.approach->final_rates, *campaign.problem(5000).problem.approach->final_rates);
  const CaptureProblem read = read_back(folder, campaign, 5004);
  CaptureProblem problem = campaign.problem(5004).problem;
  problem.name = read.name;
  EXPECT_TRUE(problem_bytes(problem) == problem_bytes(read));
}

// A design that replaces an uncertain value by a value of another form: those cases fail with a reason.
TEST(Campaign, ADesignMustLeaveThePlacesTheirForm) {
  const test::TemporaryFolder folder;
  const Campaign campaign = load(
      folder,
      head() +
          "uncertain:\n  - {path: targets.target-1.inertia, as: factor, uniform: {from: 0.9, to: 1.1}}\n"
          "design:\n"
          "  - {path: targets.target-1.inertia, values: [[1, 1, 1], {xx: 1, yy: 1, zz: 1, xy: 0, xz: 0, yz: 0}]}\n");
  EXPECT_NO_THROW(campaign.problem(0));
  try {
    campaign.problem(1000);
    ADD_FAILURE();
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("uncertain[0]: at this point of the design there are 6 numbers"));
  }
}

TEST(Campaign, StoresColumnsReadBySuccess) {
  const test::TemporaryFolder folder;
  const Campaign campaign = load(
      folder,
      head() +
          "uncertain:\n  - {path: targets.target-1.mass, as: factor, uniform: {from: 0.8, to: 1.2}}\n"
          "success: [captured, {name: gentle, holds: grasps/*/impulse_magnitude < 0.5}]\n"
          "keep: {columns: [base/velocity_change], series: {sample: 2, worst: {count: 3, by: kinetic_energy_before}}}\n"
          "confidence: 0.9\nquantiles: [0.1, 0.5]\ntime_limit: 2\n");
  std::vector<std::string> names;
  for (const Column& column : campaign.columns) names.push_back(column.name);
  EXPECT_THAT(names, testing::ElementsAre("captured", "captured/judged", "grasps/tip-1/captured",
                                          "grasps/tip-1/impulse_magnitude", "grasps/tip-2/captured",
                                          "grasps/tip-2/impulse_magnitude", "base/velocity_change/x",
                                          "base/velocity_change/y", "base/velocity_change/z", "kinetic_energy_before"));
  ASSERT_EQ(campaign.success.size(), 2u);
  EXPECT_EQ(campaign.success[1].name(), "gentle");
  EXPECT_TRUE(campaign.success[1].holds(std::vector<double>{1, 1, 1, 0.4, 1, 0.4, 0, 0, 0, 10}));
  EXPECT_FALSE(campaign.success[1].holds(std::vector<double>{1, 1, 1, 0.4, 1, 0.6, 0, 0, 0, 10}));
  EXPECT_EQ(campaign.series.sample, 2u);
  EXPECT_EQ(campaign.series.worst, 3u);
  EXPECT_EQ(campaign.confidence, 0.9);
  EXPECT_EQ(campaign.quantiles.size(), 2u);
  EXPECT_EQ(campaign.time_limit, 2);
}

// A case whose values no scenario may have is refused with the reader's words, by whichever way.
TEST(Campaign, FailedCaseHasAReason) {
  const test::TemporaryFolder folder;
  const Campaign campaign =
      load(folder, head() +
                       "set: {targets.target-1.inertia: [1, 1, 1]}\n"
                       "uncertain:\n"
                       "  - {path: 'targets.target-1.inertia[0]', uniform: {from: 1.5, to: 1.85}}\n"
                       "  - {path: 'targets.target-1.inertia[1]', uniform: {from: 0.75, to: 1}}\n");
  int faulty = 0;
  for (std::uint64_t k = 0; k < 300; ++k) {
    const auto x = campaign.draw(k);
    try {
      campaign.problem(k);
      EXPECT_LE(x[0], x[1] + 1);
    } catch (const InputError& error) {
      ++faulty;
      EXPECT_GT(x[0], x[1] + 1);
      EXPECT_THAT(error.what(), testing::HasSubstr("triangle inequality"));
    }
  }
  EXPECT_TRUE(faulty > 5 && faulty < 100) << faulty;
}

// One number for a list is for every item of it; that is more than a setter of the list knows.
TEST(Campaign, ChoicesOfNumbersMayReplaceLists) {
  const std::string gains = head() + "set: {approach.tracking: {mode: pd, kp: [49, 49, 49, 49, 49, 49], kd: 14}}\n";
  const test::TemporaryFolder folder;
  const Campaign campaign =
      load(folder, gains + "uncertain: [{path: approach.tracking.kp, discrete: {values: [40, 60]}}]\n");
  for (std::uint64_t k = 0; k < test::repetitions(20); ++k) {
    const double drawn = campaign.draw(k)[0];
    EXPECT_THAT(campaign.problem(k).problem.approach->tracking.kp, testing::Each(drawn)) << k;
  }
}

TEST(Campaign, ChoicesThatAreNoFiniteNumbersAreRefused) {
  for (const char* choice : {".inf", ".nan", "-.inf"}) {
    const test::TemporaryFolder folder;
    const std::string text =
        head() + "uncertain: [{path: contact.limit, discrete: {values: [1, " + std::string(choice) + "]}}]\n";
    EXPECT_THROW(load_campaign(folder.write("campaign.yaml", text)), InputError) << choice;
  }
}

TEST(Campaign, PlanKeepsJointNames) {
  const test::TemporaryFolder folder;
  const Campaign campaign = load(
      folder, head("scenarios/thesis/open-loop-case-1.yaml") +
                  "set:\n  approach.final_rates: {match: velocity}\n  approach.final_joints: {arm-1-joint-1: 0.1, "
                  "arm-1-joint-2: 0.2, arm-1-joint-3: 0.3, arm-2-joint-1: -0.1, arm-2-joint-2: -0.2, arm-2-joint-3: "
                  "-0.3}\nuncertain: [{path: approach.final_joints.arm-1-joint-1, as: offset, normal: {deviation: "
                  "0.01}}]\n");
  EXPECT_NEAR(campaign.problem(1).problem.approach->final_position[0], 0.1, 0.05);
  EXPECT_EQ(campaign.problem(1).problem.approach->final_position[1], 0.2);
}

// Planning warns of rates beyond a limit; stated ones would be refused.
TEST(Campaign, APlanThatIsTooFastIsFlownAsPlanned) {
  const test::TemporaryFolder folder;
  const std::string limits = "{lower: -6, upper: 6, rate: 0.001}";
  const Campaign campaign =
      load(folder, head() + "set: {\"robot.links[0].joint.limits\": " + limits +
                       ", \"robot.links[1].joint.limits\": " + limits + "}\n" +
                       "uncertain: [{path: targets.target-1.mass, as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  const CaptureProblem problem = campaign.problem(0).problem;
  EXPECT_FALSE(problem.approach->pieces.empty());
  EXPECT_FALSE(problem.approach->plan);
}

// A search that finds nothing is as long as one that does: it is made once.
TEST(Campaign, APointThatCannotBePlannedIsKnownAfterwards) {
  SKIP_UNDER_SANITIZERS();
  const test::TemporaryFolder folder;
  const Campaign campaign =
      load(folder, head() + "design: [{path: \"targets.target-1.state.position[0]\", values: [-0.9, 40]}]\n" +
                       "uncertain: [{path: targets.target-1.mass, as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
  const auto reason = [&](std::uint64_t k) -> std::string {
    try {
      campaign.problem(k);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  const std::string first = reason(1000);
  EXPECT_NE(first, "");
  EXPECT_EQ(reason(1001), first);
}

TEST(Campaign, ShippedOnesHaveNoFaults) {
  SKIP_UNDER_SANITIZERS();
  for (const char* name : {"studies/thesis-uncertain-target.yaml", "studies/thesis-monte-carlo.yaml",
                           "studies/thesis-success-map.yaml", "studies/closed-loop-monte-carlo.yaml"}) {
    const Campaign campaign = load_campaign(shipped(name));
    EXPECT_GT(campaign.cases, 0u);
    EXPECT_NO_THROW(campaign.problem(campaign.total() - 1));
  }
}

}  // namespace campaign_test
}  // namespace grapnel
