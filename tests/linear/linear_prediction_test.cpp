// Linear models beside the nonlinear motion of small disturbances: free, captured, in closed loops.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/linear/operating_point.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "linear/linear_scenarios.hpp"

namespace grapnel::testing {
namespace linear_prediction_test {

using Stability = LinearModel::Stability;
using Kind = LinearModel::Kind;

State simulated(const OperatingPoint& point, const PhaseSetup& setup, const State& start, double duration) {
  PhaseDynamics dynamics(point.model(), setup);
  const PhaseOutcome outcome = simulate_phase(dynamics, {start, point.time, point.time + duration},
                                              {.relative_tolerance = 1e-13, .absolute_tolerance = 1e-15});
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  return outcome.end_state;
}

// x' less A x by simulations of the disturbed and the undisturbed motion, extrapolated to a short time.
Eigen::VectorXd simulated_rate(const OperatingPoint& point, const PhaseSetup& setup, MinimalCoordinates& here,
                               const Eigen::MatrixXd& A, Eigen::Index i) {
  constexpr double kDisturbance = 3e-4, kTime = 5e-4;
  const auto rate = [&](double duration) {
    const State nominal = simulated(point, setup, point.state, duration);
    MinimalCoordinates there(point.model(), setup.closures, nominal, here.fixed());
    Eigen::VectorXd change = Eigen::VectorXd::Zero(here.size());
    for (const double sign : {1.0, -1.0}) {
      const State start = here.moved(i, sign * kDisturbance);
      const State end = simulated(point, setup, start, duration);
      const auto x = [&](const MinimalCoordinates& about, const State& state) {
        const Eigen::VectorXd all = about.deviation(state);
        const Eigen::Index n = all.size() / 2;
        Eigen::VectorXd some(here.size());
        some << Eigen::VectorXd(all.head(n)(here.independent())), Eigen::VectorXd(all.tail(n)(here.independent()));
        return some;
      };
      change += sign * (x(there, end) - x(here, start) - duration * A * x(here, start));
    }
    return Eigen::VectorXd(change / (2 * kDisturbance * duration));
  };
  return 2 * rate(0.5 * kTime) - rate(kTime);
}

// The largest error of x', of the largest entry of A, along every state. `closed`: with the scenario's laws.
double prediction_error(const CaptureProblem& problem, double at, bool closed) {
  const LinearModel model = linearize(problem, {.time = at});
  CaptureSteps steps(problem, CaptureDetail::columns);
  const OperatingPoint point(problem, task_at(steps, at));
  PhaseSetup setup = closed ? setup_of_laws(point) : setup_of_plant(point, false);
  std::vector<std::uint8_t> fixed = EvaluatedPhase(point, setup).prescribed();
  for (std::size_t v = 0; v < fixed.size(); ++v) fixed[v] = fixed[v] || point.elsewhere[v];
  MinimalCoordinates here(point.model(), setup.closures, point.state, fixed);
  Eigen::MatrixXd A = matrix_of(model.A);
  if (closed) {
    EXPECT_TRUE(model.closed_loop) << model.closed_loop_absent;
    if (!model.closed_loop) return 1;
    A += matrix_of(model.B) * matrix_of(model.closed_loop->K);
  }
  setup.project_loops = true;
  EXPECT_EQ(A.rows(), here.size());
  double largest = 0;
  for (Eigen::Index i = 0; i < here.size(); ++i)
    largest = std::max(largest, simulated_rate(point, setup, here, A, i).cwiseAbs().maxCoeff());
  const double error = largest / A.cwiseAbs().maxCoeff();
  std::printf("[ measured ] %lld states: error %.2g of the largest entry of A, %.3g\n",
              static_cast<long long>(A.rows()), error, A.cwiseAbs().maxCoeff());
  return error;
}

TEST(LinearPrediction, OfAFloatingArmWithoutLaws) {
  EXPECT_LT(prediction_error(problem_of(floating_arm("joints: free")), 0.7, false), 1e-4);
}

TEST(LinearPrediction, OfAFloatingArmUnderPd) {
  EXPECT_LT(prediction_error(problem_of(floating_arm("joints: pd, kp: 30, kd: 12")), 0.7, true), 1e-4);
}

TEST(LinearPrediction, OfAFloatingArmUnderComputedTorqueAndAttitudeControl) {
  const std::string motion = "joints: computed_torque, kp: 4, kd: 3, base_control: {kp: 20, kd: 30}";
  EXPECT_LT(prediction_error(problem_of(floating_arm(motion)), 0.7, true), 1e-4);
}

TEST(LinearPrediction, OfAJoinedSystemWithoutLoop) {
  const CaptureProblem problem =
      load_scenario(shipped("thesis/open-loop-case-1.yaml"),
                    {{parse_override("post_impact.joints=pd"), parse_override("post_impact.kp=40"),
                      parse_override("post_impact.kd=30"), parse_override("post_impact.duration=5")}});
  EXPECT_LT(prediction_error(problem, 21, true), 1e-4);
}

TEST(LinearPrediction, OfAJoinedSystemWithClosedLoop) {
  const CaptureProblem problem =
      load_scenario(shipped("thesis/closed-loop.yaml"), {{parse_override("post_impact.duration=5")}});
  EXPECT_LT(prediction_error(problem, 21, false), 1e-4);
  const CaptureProblem held =
      load_scenario(shipped("thesis/closed-loop.yaml"),
                    {{parse_override("post_impact.joints=pd"), parse_override("post_impact.kp=40"),
                      parse_override("post_impact.kd=30"), parse_override("post_impact.duration=5")}});
  EXPECT_LT(prediction_error(held, 21, true), 1e-4);
}

// Momentum and free motion are no instability; friction and pd damp the rest.
TEST(LinearPrediction, VerdictWithoutConservedMomentaAndDrift) {
  const LinearModel model = linear_model(floating_arm("joints: pd, kp: 30, kd: 12"), 0.7);
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  const auto& modes = model.closed_loop->stability;
  const auto count = [&](Kind kind) {
    return std::ranges::count_if(modes.eigenvalues, [&](const auto& e) { return e.kind == kind; });
  };
  // The base tumbles freely: growth within its rate decides nothing.
  EXPECT_EQ(modes.verdict, Stability::undecided) << modes.reason;
  EXPECT_THAT(modes.reason, ::testing::HasSubstr("within the rate of the free rotation"));
  EXPECT_EQ(count(Kind::grows), 0);
  EXPECT_EQ(count(Kind::conserved), 6);
  EXPECT_GE(count(Kind::drift), 3);
  EXPECT_EQ(modes.eigenvalues.size(), 16u);
  EXPECT_EQ(model.closed_loop->margins.size(), 2u);
}

// Growth that is slower than the motion turns, and thrusters without their limits, decide nothing.
TEST(LinearPrediction, SlowGrowthAndThrustersLeaveStabilityUndecided) {
  const LinearModel coast = linearize(load_scenario(shipped("coast.yaml")), {.time = 0});  // tides of an orbit
  EXPECT_EQ(coast.open_loop.verdict, Stability::undecided) << coast.open_loop.reason;
  EXPECT_THAT(coast.open_loop.reason, ::testing::HasSubstr("slower than the motion turns"));
  const LinearModel thrusters = linearize(load_scenario(shipped("attitude-manoeuvre.yaml")), {.time = 0});
  ASSERT_TRUE(thrusters.closed_loop) << thrusters.closed_loop_absent;
  EXPECT_EQ(thrusters.closed_loop->stability.verdict, Stability::undecided) << thrusters.closed_loop->stability.reason;
  EXPECT_THAT(thrusters.closed_loop->stability.reason, ::testing::HasSubstr("limits of the thrusters"));
}

// Wheels that hold the attitude: one channel per axis of the base, and the momentum that they store is no instability.
TEST(LinearPrediction, WheelsAreChannelsOfTheBase) {
  const CaptureProblem problem = load_scenario(shipped("wheels-keep-attitude.yaml"));
  const LinearModel model = linearize(problem, {.time = 100});
  ASSERT_TRUE(model.closed_loop) << model.closed_loop_absent;
  EXPECT_EQ(model.closed_loop->stability.verdict, Stability::stable) << model.closed_loop->stability.reason;
  std::vector<std::string> channels;
  for (const auto& margin : model.closed_loop->margins) channels.push_back(margin.channel);
  EXPECT_THAT(channels, ::testing::IsSupersetOf({"base/torque/x", "base/torque/y", "base/torque/z"}));
  EXPECT_EQ(channels.size(), 9u);
}

}  // namespace linear_prediction_test
}  // namespace grapnel::testing
