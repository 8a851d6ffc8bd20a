/// Plans of the scenarios that are shipped are no worse than they have been.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace shipped_plans_test {

struct ShippedPlan {
  const char* scenario;
  double objective;  // of the plan by the program of commit 6929b7f (`grapnel run`, summary.json)
};

class ShippedPlans : public ::testing::TestWithParam<ShippedPlan> {};

TEST_P(ShippedPlans, QualityUnchanged) {
  SKIP_UNDER_SANITIZERS();
  const CaptureProblem problem =
      load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + GetParam().scenario + ".yaml");
  const ApproachPlan plan = plan_approach(problem, plan_targets(problem));
  EXPECT_EQ(plan.failure, "");
  ASSERT_TRUE(plan.report.found);
  std::printf("[ measured ] %s: %.10g\n", GetParam().scenario, plan.report.objective_value);
  EXPECT_LE(plan.report.objective_value, GetParam().objective * (1 + 1e-6));
}

INSTANTIATE_TEST_SUITE_P(
    Shipped, ShippedPlans,
    ::testing::Values(
        ShippedPlan{"bias-momentum", 0.9647038365990769}, ShippedPlan{"compliant-grip", 3.7980567267146},
        ShippedPlan{"contact-rebound", 1.45400500605389}, ShippedPlan{"detumble-envisat", 0.9682043661939121},
        ShippedPlan{"dual-arm-detumbling", 4.058017135150113},
        ShippedPlan{"dual-arm-satellite-panels", 3.970721480748197},
        ShippedPlan{"dual-arm-tumbling-targets", 3.7980567267146053}, ShippedPlan{"first-plan", 4.94821426571839},
        ShippedPlan{"heavy-satellite-flat-spin", 0.2507931119538974},
        ShippedPlan{"impedance-capture", 0.7194482770959184}, ShippedPlan{"orbit-detumble", 4.750416434476997},
        ShippedPlan{"quiet-approach", 10.57631052951356}, ShippedPlan{"real-joints", 3.111897080965323},
        ShippedPlan{"six-arm-servicer", 16.316914606944845}, ShippedPlan{"triple-arm-satellite", 4.329962683494593},
        ShippedPlan{"wheels-keep-attitude", 1.5938395019593659}),
    [](const auto& each) {
      std::string name = each.param.scenario;
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

}  // namespace shipped_plans_test
}  // namespace grapnel::testing
