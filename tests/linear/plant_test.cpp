// The plant of linear models in closed form, beside differences of the simulated accelerations.
#include <gtest/gtest.h>

#include "grapnel/linear/plant.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "linear/linear_scenarios.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace plant_test {

// The largest difference between both, of the largest entry; absent without a closed form.
std::optional<double> difference(const CaptureProblem& stated, double at, Worst& worst) {
  const CaptureProblem problem = is_flexible(stated.robot) ? flexible_problem(stated) : stated;
  CaptureSteps steps(stated, CaptureDetail::columns);
  const OperatingPoint point(problem, task_at(steps, at));
  const PhaseSetup setup = setup_of_plant(point, false);
  std::vector<std::uint8_t> fixed = EvaluatedPhase(point, setup).prescribed();
  for (std::size_t v = 0; v < fixed.size(); ++v) fixed[v] = fixed[v] || point.elsewhere[v];
  MinimalCoordinates coordinates(point.model(), setup.closures, point.state, fixed);
  const Eigen::VectorXd constant = Eigen::VectorXd::LinSpaced(point.model().velocities(), -1, 1);
  const std::optional<Derivative> exact = analytical_rates(point, coordinates, setup, constant);
  if (!exact) return {};
  const Derivative differences = rates_by_differences(point, coordinates, setup, constant);
  const double size = differences.value.cwiseAbs().maxCoeff();
  EXPECT_GT(size, 1e-3);
  return worst.note((exact->value - differences.value).cwiseAbs().maxCoeff() / size, 0);
}

TEST(Plant, InClosedFormAgreesWithDifferences) {
  // The differences have errors of 1e-10 to 1e-9.
  const auto check = [](const char* name, const CaptureProblem& problem, double at) {
    SCOPED_TRACE(name);
    Worst worst(name);
    const std::optional<double> found = difference(problem, at, worst);
    ASSERT_TRUE(found);
    EXPECT_LT(*found, 1e-7);
  };
  check("floating arm, viscous friction", problem_of(floating_arm("joints: free")), 0.7);
  check("hinge with friction",
        problem_of(hinge(20, 1.6, "", ", friction: {viscous: 0.1, coulomb: 0.2, transition_rate: 0.1}")), 0);
  check("joined", load_scenario(shipped("thesis/open-loop-case-1.yaml"), {{parse_override("post_impact.duration=5")}}),
        21);
  if (test::kSanitized) return;
  check("flexible", load_scenario(shipped("station-arm-flexible.yaml")), 0);
  check("closed loop", load_scenario(shipped("thesis/closed-loop.yaml"), {{parse_override("post_impact.duration=5")}}),
        21);
}

TEST(Plant, HasNoClosedFormInAnOrbitsField) {
  Worst worst("orbit");
  EXPECT_FALSE(difference(load_scenario(shipped("orbit-drift.yaml")), 0, worst));
}

}  // namespace plant_test
}  // namespace grapnel::testing
