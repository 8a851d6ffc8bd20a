/// What nobody can plan is answered with the reason, after so little work that nobody waits for it:
/// bench/plan_bench.cpp has the times.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/impossible_plans.hpp"
#include "grapnel/approach/approach_plan.hpp"

namespace grapnel::testing {
namespace impossible_plan_test {

using ::testing::HasSubstr;

class ImpossiblePlans : public ::testing::TestWithParam<ImpossiblePlan> {};

TEST_P(ImpossiblePlans, AreAnsweredWithTheReason) {
  const CaptureProblem problem = GetParam().problem();
  const ApproachPlan plan = plan_approach(problem, plan_targets(problem));
  EXPECT_THAT(plan.failure, HasSubstr(GetParam().reason));
  EXPECT_FALSE(plan.report.found);
  const double joints = static_cast<double>(plan.report.joints.size());
  const double work = static_cast<double>(plan.report.rhs_evaluations) * joints;
  std::printf("[ measured ] %s: %ld evaluations of %.0f joints\n", GetParam().name.c_str(), plan.report.rhs_evaluations,
              joints);
  EXPECT_LT(work, 2e6);  // measured up to 1.5e6; straight-in-fast/two-arms took 9.2e6 before
}

INSTANTIATE_TEST_SUITE_P(Shipped, ImpossiblePlans, ::testing::ValuesIn(impossible_plans()), [](const auto& param) {
  std::string name = param.param.name;
  for (char& c : name) {
    if (c == '-' || c == '/') c = '_';
  }
  return name;
});

}  // namespace impossible_plan_test
}  // namespace grapnel::testing
