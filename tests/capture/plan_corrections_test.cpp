/// The iteration that corrects a plan by simulations of it, with stated errors in place of simulations.

#include <gtest/gtest.h>

#include <vector>

#include "grapnel/approach/straight_in_simulations.hpp"

namespace grapnel::testing {
namespace plan_corrections_test {

// A plan whose joint is at the number of the correction, and whose simulated position error is errors[i].
struct StatedErrors {
  std::vector<double> errors;
  double of_plan = 0;           // position error that each plan reports itself
  std::size_t infeasible = 99;  // number of a plan that cannot be made
  PlanDraft draft;
  std::size_t plans = 0;
  std::vector<double> corrected;  // errors that the corrections received

  StatedErrors(std::vector<double> stated) : errors(std::move(stated)) {
    draft.position = {-1};
    draft.plan.report.miss.resize(1);
  }
  SimulatedErrors run(int max_corrections) {
    const auto gap = [](double error) { return Gaps{{.position = {error, 0, 0}}}; };
    const auto plan = [&, gap] {
      EXPECT_EQ(draft.position[0], -1) << "each plan continues the original draft";
      if (plans++ == infeasible) throw Unplannable("the corrected plan does not exist");
      draft.position = {static_cast<double>(plans - 1)};
      return gap(of_plan);
    };
    const auto simulate = [&, gap] { return gap(errors.at(plans - 1)); };
    const auto correct = [&](const Gaps& left) { corrected.push_back(left[0].position[0]); };
    return correct_by_simulations(draft, {plan, simulate, correct}, max_corrections);
  }
};

TEST(PlanCorrections, EndWithinTolerance) {
  StatedErrors s({1, 1e-3, 1e-11, 0});
  EXPECT_EQ(s.run(9).gaps[0].position[0], 1e-11);
  EXPECT_EQ(s.draft.position[0], 2);
  EXPECT_EQ(s.corrected, (std::vector<double>{1, 1e-3}));
}

TEST(PlanCorrections, KeepTheBestPlanAfterThreeWithoutImprovement) {
  StatedErrors s({1, 0.5, 0.6, 0.7, 0.8, 0});
  EXPECT_EQ(s.run(9).gaps[0].position[0], 0.5);
  EXPECT_EQ(s.draft.position[0], 1);
  EXPECT_EQ(s.draft.plan.report.miss[0].distance, 0.5);
  EXPECT_EQ(s.plans, 5u);
}

TEST(PlanCorrections, EndAtTheirMaximumNumber) {
  StatedErrors s({1, 0.5, 0.25, 0.125, 0.0625});
  EXPECT_EQ(s.run(3).gaps[0].position[0], 0.125);
  EXPECT_EQ(s.plans, 4u);
}

TEST(PlanCorrections, DoNotCorrectErrorsOfThePlanItself) {
  StatedErrors s({0.75, 0.25 + 1e-11});
  s.of_plan = 0.25;
  EXPECT_LT(s.run(9).beside, 2e-11);
  EXPECT_EQ(s.corrected, (std::vector<double>{0.5}));
}

TEST(PlanCorrections, EndAtAnInfeasiblePlanUnlessItIsTheFirst) {
  StatedErrors s({1, 0.5, 0.25});
  s.infeasible = 2;
  EXPECT_EQ(s.run(9).gaps[0].position[0], 0.5);
  EXPECT_EQ(s.draft.position[0], 1);
  StatedErrors first({1});
  first.infeasible = 0;
  EXPECT_THROW(first.run(9), Unplannable);
}

}  // namespace plan_corrections_test
}  // namespace grapnel::testing
