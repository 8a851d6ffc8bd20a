/// Cases of studies are simulated with the detail that their columns require: every column equals that of a complete
/// run, bit for bit.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "campaign/study_case.hpp"
#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace case_detail_test {

struct Detail {
  const char* name;
  const char* file;
  bool clearance;
};
void PrintTo(const Detail& d, std::ostream* out) { *out << d.name; }

class CaseDetail : public ::testing::TestWithParam<Detail> {};
INSTANTIATE_TEST_SUITE_P(Scenarios, CaseDetail,
                         ::testing::Values(Detail{"thesis", "thesis/open-loop-case-1.yaml", false},
                                           Detail{"thesis_watched", "thesis/open-loop-case-1.yaml", true},
                                           Detail{"planned", "thesis/open-loop-case-3-planned.yaml", false},
                                           Detail{"closed_loop", "thesis/closed-loop.yaml", false},
                                           Detail{"limits", "seven-joint-dual-capture.yaml", false},
                                           Detail{"grasp_later", "second-grip-later.yaml", false},
                                           Detail{"envelope", "dual-arm-envelope-capture.yaml", true},
                                           Detail{"rebound", "contact-rebound.yaml", false},
                                           Detail{"yielding", "compliant-grip.yaml", false}),
                         [](const auto& detail) { return std::string(detail.param.name); });

StudyCase shipped_case(const Detail& detail) {
  StudyCase point;
  point.problem = load_scenario(test::shipped(std::string("scenarios/") + detail.file));
  point.problem.clearance.enabled = detail.clearance;
  point.problem.output_interval = 0.1;
  // Any plan suffices.
  if (auto& approach = point.problem.approach; approach && approach->plan)
    approach->plan->objective = PlanSetup::Objective::as_found;
  if (point.problem.post_impact && point.problem.post_impact->releases.empty())
    point.problem.post_impact->duration = std::min(point.problem.post_impact->duration, 2.0);
  point.inward_normals = inward_normals(point.problem);
  return point;
}

void expect_same(const StudyCase& point, const CaptureResult& full, StudyMode mode) {
  const std::vector<Column> columns = standard_columns(point.problem, mode == StudyMode::run);
  const CaseRow row = run_case(point, mode, columns);
  int numbers = 0;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const double whole = columns[c].value(point, full);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(whole), std::bit_cast<std::uint64_t>(row.values[c]))
        << columns[c].name << ": " << whole << ", " << row.values[c];
    numbers += whole == whole;
  }
  EXPECT_EQ(row.status == CaseStatus::ok, full.status == CaptureStatus::completed) << row.reason << full.failure;
  EXPECT_GT(numbers, 20);
  std::printf("[ measured ] %zu columns with %d numbers, the same bits\n", columns.size(), numbers);
}

// Columns of loads exist only on request, and then cover all phases.
void expect_same_loads(const StudyCase& point, const CaptureResult& full) {
  const std::vector<Column> columns = offered_columns(point.problem, true);
  ASSERT_EQ(detail_of(columns), CaptureDetail::columns_and_loads);
  const CaseRow row = run_case(point, StudyMode::run, columns);
  int numbers = 0;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (!columns[c].needs_loads) continue;
    const double whole = columns[c].value(point, full);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(whole), std::bit_cast<std::uint64_t>(row.values[c])) << columns[c].name;
    numbers += whole == whole;
  }
  EXPECT_GT(numbers, 40);
}

TEST_P(CaseDetail, ARunHasTheColumnsAndLoadsOfACompleteOne) {
  const StudyCase point = shipped_case(GetParam());
  const CaptureResult full = simulate_capture(point.problem);
  EXPECT_FALSE(full.series.time.empty());
  expect_same(point, full, StudyMode::run);
  expect_same_loads(point, full);
}

TEST_P(CaseDetail, AnImpactAloneHasTheColumnsOfACompleteOne) {
  const StudyCase point = shipped_case(GetParam());
  expect_same(point, simulate_impact_only(point.problem), StudyMode::impact);
}

TEST(CaseDetail, EvaluatesLoadsOnlyOnRequest) {
  StudyCase point = shipped_case({"", "thesis/open-loop-case-1.yaml", false});
  EXPECT_EQ(detail_of(standard_columns(point.problem, true)), CaptureDetail::columns);
  point.problem.robot.end_effectors[0].rating.force = 10;
  EXPECT_EQ(detail_of(standard_columns(point.problem, true)), CaptureDetail::columns_and_loads);
  EXPECT_EQ(detail_of(offered_columns(point.problem, false)), CaptureDetail::columns);
  int loads = 0;
  for (const Column& column : offered_columns(point.problem, true)) {
    const bool load = column.name.starts_with("loads/") || column.name.starts_with("load_times/");
    loads += load;
    const bool of_every_step = column.name == "stable" || column.name.ends_with("/saturated");
    EXPECT_EQ(column.by_default, !load && !of_every_step) << column.name;
  }
  EXPECT_EQ(loads, 2 * (6 * 6 + 2 * 4));
}

TEST(CaseDetail, StatedMotionNeedsNoPlanning) {
  StudyCase point = shipped_case({"", "thesis/open-loop-case-1.yaml", false});
  const CaptureResult planned = simulate_impact_only(point.problem);
  point.problem.approach->final_rates = planned.plan->final_rates;
  point.problem.approach->match.reset();
  const CaptureResult full = simulate_capture(point.problem);
  expect_same(point, full, StudyMode::run);
  const CaptureResult lean = simulate_capture(point.problem, {}, CaptureDetail::columns);
  EXPECT_EQ(lean.plan->joints, full.plan->joints);
  EXPECT_EQ(lean.plan->final_position, full.plan->final_position);
  EXPECT_EQ(lean.plan->rhs_evaluations, 0);
}

TEST(CaseDetail, ReportsProgressInEveryStepAndCanEndACase) {
  StudyCase point = shipped_case({"", "thesis/open-loop-case-1.yaml", false});
  const std::vector<Column> columns = standard_columns(point.problem, true);
  long reports = 0;
  const CaseRow row = run_case(point, StudyMode::run, columns,
                               [&](const std::string& phase, double, double) { reports += phase != "planning"; });
  const CaptureResult full = simulate_capture(point.problem);
  EXPECT_EQ(row.status, CaseStatus::ok);
  EXPECT_EQ(reports, full.cost.at(0).steps + full.cost.at(1).steps);
  struct TooLong : std::exception {
    const char* what() const noexcept override { return "too long"; }
  };
  const CaseRow aborted = run_case(point, StudyMode::run, columns, [&](const std::string&, double time, double) {
    if (time > 5) throw TooLong();
  });
  EXPECT_EQ(aborted.status, CaseStatus::failed);
  EXPECT_EQ(aborted.reason, "too long");
}

}  // namespace case_detail_test
}  // namespace grapnel
