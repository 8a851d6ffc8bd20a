#include "grapnel/campaign/run_campaign.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace run_study_test {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string thesis(const std::string& name) { return test::shipped("scenarios/thesis/" + name); }

// Two scenarios, three angles of which one is unreachable, two speeds. Two initial guesses of the search suffice here.
std::string mixed_study() {
  return "name: mixed\nsimulate: impact\nset: {approach.plan.starts: 2}\naxes:\n"
         "  - name: case\n    values:\n"
         "      - {label: 'one, two', scenario: " +
         thesis("open-loop-case-1-planned.yaml") + "}\n" +
         "      - {label: three, scenario: " + thesis("open-loop-case-3-planned.yaml") + "}\n" +
         "  - {quantity: approach_angle, values: [0, 180, 20], unit: deg}\n"
         "  - {quantity: relative_speed, values: [0, 0.1]}\n";
}

std::size_t column(const Campaign& study, const std::string& name) {
  for (std::size_t c = 0; c < study.columns.size(); ++c) {
    if (study.columns[c].name == name) return c;
  }
  ADD_FAILURE() << "no column " << name;
  return 0;
}

TEST(RunStudy, TheSameBitsForAnyNumberOfThreads) {
  const test::Folder folder;
  const Campaign study = load_study(folder.write("study.yaml", mixed_study()));
  std::string csv, hdf5;
  for (const int threads : {1, 2, 4}) {
    std::uint64_t next = 0;
    const std::vector<CaseRow> rows =
        run_sweep(study, {.threads = threads}, [&](const CaseRow& row) { EXPECT_EQ(row.index, next++); });
    ASSERT_EQ(rows.size(), 12u);
    EXPECT_EQ(next, 12u);
    write_campaign_tables(folder.path(), study, "1", true, [&](const TakeRow& take) {
      for (const CaseRow& row : rows) take(row);
    });
    const std::string now_csv = test::read_bytes(folder.path() / "table.csv");
    const std::string now_hdf5 = test::read_bytes(folder.path() / "table.h5");
    if (threads == 1) csv = now_csv, hdf5 = now_hdf5;
    EXPECT_EQ(csv, now_csv) << threads;
    EXPECT_EQ(hdf5, now_hdf5) << threads;
  }
  EXPECT_THAT(csv, StartsWith("point,case,approach_angle [deg],relative_speed [m/s],status,reason,captured [1],"));
  EXPECT_THAT(csv, HasSubstr("\n0,\"one, two\",0,0,ok,,1,"));
  EXPECT_THAT(csv, HasSubstr("\n11,three,20,0.1,ok,,1,"));
  EXPECT_THAT(csv, HasSubstr("\n2,\"one, two\",180,0,unreachable,"));
}

TEST(RunStudy, FailedPointHasAReasonAndTheOthersContinue) {
  const test::Folder folder;
  const Campaign study = load_study(folder.write("study.yaml", mixed_study()));
  const std::vector<CaseRow> rows = run_sweep(study, {});
  EXPECT_EQ(count_of(rows, CaseStatus::ok), 8u);
  EXPECT_EQ(count_of(rows, CaseStatus::unreachable), 4u);
  const std::size_t magnitude = column(study, "grasps/tip-1/impulse_magnitude");
  for (const CaseRow& row : rows) {
    const bool ok = row.status == CaseStatus::ok;
    EXPECT_EQ(row.reason.empty(), ok);
    EXPECT_EQ(std::isnan(row.values[magnitude]), !ok);
    EXPECT_EQ(row.reason.find("planning the approach") != std::string::npos, !ok) << row.reason;
    EXPECT_EQ(row.reason.find('\n'), std::string::npos);
  }
}

TEST(RunStudy, APointThatBreaksConservationHasFailed) {
  const test::Folder folder;
  const Campaign study = load_study(
      folder.write("study.yaml", "name: steps\nscenario: " + thesis("open-loop-case-1-planned.yaml") +
                                     "\nset: {integration.method: rk4, contact: {gap: weld_as_found}}\naxes:\n"
                                     "  - {path: integration.step, values: [0.02, 1.9, 2]}\n"));
  const std::vector<CaseRow> rows = run_sweep(study, {});
  const std::size_t pass = column(study, "ledger/pass"), captured = column(study, "captured");
  EXPECT_EQ(rows[0].status, CaseStatus::ok) << rows[0].reason;
  EXPECT_EQ(rows[0].values[pass], 1);
  for (std::size_t i : {1, 2}) {
    const CaseRow& row = rows[i];
    EXPECT_EQ(row.status, CaseStatus::failed);
    EXPECT_THAT(row.reason, ::testing::MatchesRegex("conservation check failed: energy_drift is .*, bound 1e-10"));
    EXPECT_EQ(row.values[pass], 0);
    EXPECT_TRUE(std::isnan(row.values[captured]));
  }
  const std::string summary = sweep_summary(study, rows);
  EXPECT_THAT(summary, HasSubstr("3 points, 1 ok, 2 failed"));
  EXPECT_THAT(summary,
              HasSubstr("captured: 1 assumed, no envelope\n"));  // the thesis's robot has no grippers
  EXPECT_THAT(summary, HasSubstr("2 × failed: conservation check failed: energy_drift\n"));
}

TEST(RunStudy, APointIsTheScenarioWithItsValues) {
  const test::Folder folder;
  const Campaign study = load_study(folder.write(
      "study.yaml", "name: masses\nscenario: " + thesis("open-loop-case-1-planned.yaml") +
                        "\nset: {approach.duration: 10, post_impact.duration: 1}\naxes:\n"
                        "  - {path: targets.target-1.mass, values: [10, 20]}\n"
                        "  - {path: targets.target-2.state.angular_velocity, values: [[0, 0, 0.1], [0, 0, -0.2]]}\n"));
  const std::vector<CaseRow> rows = run_sweep(study, {});
  const std::vector<Override> point_3{{"approach.duration", "10"},
                                      {"post_impact.duration", "1"},
                                      {"targets.target-1.mass", "20"},
                                      {"targets.target-2.state.angular_velocity", "[0, 0, -0.2]"}};
  const CaptureResult r = simulate_capture(load_scenario(thesis("open-loop-case-1-planned.yaml"), point_3));
  ASSERT_EQ(rows.size(), 4u);
  const CaseRow& row = rows[3];
  ASSERT_EQ(row.status, CaseStatus::ok) << row.reason;
  EXPECT_EQ(row.values[column(study, "grasps/tip-2/angular_impulse/z")], r.impact()->grasps[1].angular_impulse[2]);
  EXPECT_EQ(row.values[column(study, "grasps/tip-1/impulse/x")], r.impact()->grasps[0].impulse[0]);
  EXPECT_EQ(row.values[column(study, "end/base/angular_velocity/z")], r.post_impact_end->base.angular_velocity[2]);
  EXPECT_EQ(row.values[column(study, "ledger/pass")], 1);
  const double P = row.values[column(study, "grasps/tip-1/impulse_magnitude")];
  EXPECT_NEAR(std::hypot(row.values[column(study, "grasps/tip-1/impulse_normal")],
                         row.values[column(study, "grasps/tip-1/impulse_tangential")]),
              P, 1e-15 * std::max(P, 1.0));
  EXPECT_FALSE(study.design[1].is_numeric);
  EXPECT_EQ(study.design[1].values[1].label, "[0, 0, -0.2]");
}

TEST(RunStudy, ColumnsMayBeChosen) {
  const test::Folder folder;
  const Campaign study = load_study(folder.write(
      "study.yaml", mixed_study() + "columns: [grasps/*/impulse_magnitude, base/velocity_change, captured]\n"));
  std::vector<std::string> names;
  for (const Column& c : study.columns) names.push_back(c.name);
  EXPECT_THAT(names, ::testing::ElementsAre("captured", "captured/judged", "grasps/tip-1/impulse_magnitude",
                                            "grasps/tip-2/impulse_magnitude", "base/velocity_change/x",
                                            "base/velocity_change/y", "base/velocity_change/z"));
}

// --- Invariants at a fixed configuration ---

using Impulses = std::vector<double>;  // [angular; linear] of each grasp, then the base's change

Impulses impulses(const CaptureProblem& problem) {
  const CaptureResult r = simulate_impact_only(problem);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  Impulses all;
  for (const GraspImpulse& g : r.impact()->grasps) {
    for (int k = 0; k < 3; ++k) all.push_back(g.angular_impulse[k]);
    for (int k = 0; k < 3; ++k) all.push_back(g.impulse[k]);
  }
  for (int k = 0; k < 3; ++k) all.push_back(r.impact()->base_angular_velocity_change[k]);
  return all;
}

double size(const Impulses& a) {
  double largest = 0;
  for (const double x : a) largest = std::max(largest, std::abs(x));
  return largest;
}

CaptureProblem at_once() {
  const test::Folder folder;
  return load_scenario(folder.write("at-once.yaml", test::impact_at_once()));
}

// The target's motion changes u- but not W: six components per target.
TEST(RunStudy, TheImpulseIsAffineInEveryComponentOfTheRelativeVelocity) {
  for (std::size_t target = 0; target < 2; ++target) {
    for (int k = 0; k < 6; ++k) {
      const auto at = [&](double change) {
        CaptureProblem problem = at_once();
        Twistd& V = problem.targets[target].V_WT;
        (k < 3 ? V.angular[k] : V.linear[k - 3]) += change;
        return impulses(problem);
      };
      const Impulses p0 = at(0), p1 = at(0.1), p2 = at(0.25), p3 = at(-0.4);
      double worst = 0;
      for (std::size_t i = 0; i < p0.size(); ++i) {
        const double slope = (p1[i] - p0[i]) / 0.1;
        worst = std::max({worst, std::abs(p0[i] + 0.25 * slope - p2[i]), std::abs(p0[i] - 0.4 * slope - p3[i])});
      }
      EXPECT_GT(size(p1) - size(p0) == 0 ? 0 : size(p1), 0.1);
      EXPECT_LT(worst / size(p3), 1e-12) << target << " " << k;
    }
  }
}

TEST(RunStudy, TheImpulseIsProportionalToAllOfTheRelativeVelocity) {
  CaptureProblem problem = at_once();
  const auto scaled = [&](double s) {
    CaptureProblem p = problem;
    for (double& rate : p.joint_rate) rate *= s;
    p.V_WB = s * *p.V_WB;
    for (TargetSetup& t : p.targets) t.V_WT = s * t.V_WT;
    return impulses(p);
  };
  const Impulses one = scaled(1), three = scaled(3);
  ASSERT_GT(size(one), 0.1);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_LT(std::abs(three[i] - 3 * one[i]) / size(three), 1e-12);
}

}  // namespace run_study_test
}  // namespace grapnel
