/// Infeasible plans fail quickly with the reason: bench/plan_bench.cpp has the times.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/impossible_plans.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace impossible_plan_test {

using ::testing::HasSubstr;

class ImpossiblePlans : public ::testing::TestWithParam<ImpossiblePlan> {};

TEST_P(ImpossiblePlans, ReportReason) {
  constexpr double kLong = 150;
  if (GetParam().work > kLong) SKIP_UNDER_SANITIZERS();
  const CaptureProblem problem = GetParam().problem();
  const PlanAnswer plan = answer(problem);
  EXPECT_THAT(plan.failure, HasSubstr(GetParam().reason));
  EXPECT_FALSE(plan.found);
  const double work = 1e-3 * static_cast<double>(plan.rhs_evaluations) * plan.joints;
  std::printf("[ measured ] %s: %.0f thousand evaluations of a joint\n", GetParam().name.c_str(), work);
  EXPECT_LE(work, 2 * GetParam().work);
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
