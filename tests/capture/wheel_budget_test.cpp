/// What a plan allows reaction wheels that keep the base's attitude to hold, from the run that flies it: momenta by its
/// own record of the wheels' rates.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/recorded.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/planned_base.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace wheel_budget_test {

using Objective = PlanSetup::Objective;
using ::testing::Contains;
using ::testing::HasSubstr;

// Four wheels at a bias keep the base's attitude while an arm of six joints reaches for a handle.
CaptureProblem reaching() {
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml");
  p.impact.reset(), p.post_impact.reset();
  p.output_interval = 0.1;
  p.approach->base_control->feedforward = true;
  for (WheelSetup& wheel : p.robot.wheels) wheel.rate = 100;
  return p;
}
PlanSetup& plan_of(CaptureProblem& p) { return *p.approach->plan; }

CaptureResult flown(const CaptureProblem& p) {
  CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.plan && r.plan->found);
  EXPECT_LT(meeting(p, r, 0, last_sample(r, "approach")).distance(), 1e-8);
  return r;
}

// Largest share of each wheel's momentum in the run.
std::vector<double> shares(const CaptureProblem& p, const CaptureResult& r) {
  std::vector<double> largest(p.robot.wheels.size());
  for (std::size_t i = 0; i <= last_sample(r, "approach"); ++i) {
    for (std::size_t w = 0; w < largest.size(); ++w) {
      const double rate = value_at(r, "wheels/rate", i, static_cast<int>(w));
      largest[w] = std::max(largest[w], std::abs(rate) / p.robot.wheels[w].rate);
    }
  }
  return largest;
}
double largest_share(const CaptureProblem& p, const CaptureResult& r) {
  const std::vector<double> all = shares(p, r);
  return *std::max_element(all.begin(), all.end());
}

TEST(WheelBudget, HoldsInSimulation) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = reaching();
  for (const bool turns_to_speeds : {false, true}) {
    SCOPED_TRACE(turns_to_speeds);
    // Motion of the wheels that gives no torque counts too.
    if (turns_to_speeds) {
      p.approach->base_control->wheel_speed_rate = 0.05;
      p.approach->base_control->wheel_speeds = {45, -45, 45, -45};
    }
    plan_of(p).wheel_momentum.reset();
    const double direct = largest_share(p, flown(p));
    plan_of(p).wheel_momentum = 0.9 * direct;
    const CaptureResult r = flown(p);
    std::printf("[ measured ] %.6f of what wheels can hold, %.6f allowed, %.6f without that, %d knots\n",
                largest_share(p, r), 0.9 * direct, direct, r.plan->way->knots);
    EXPECT_LT(largest_share(p, r), 0.9 * direct + 1e-4);
    EXPECT_GT(largest_share(p, r), 0.9 * direct - 1e-2);  // it gives away no more than it has to
    const std::vector<double> in_run = shares(p, r);
    ASSERT_EQ(r.plan->way->wheels.size(), in_run.size());
    for (std::size_t w = 0; w < in_run.size(); ++w) {
      EXPECT_EQ(r.plan->way->wheels[w].wheel, p.robot.wheels[w].name);
      EXPECT_NEAR(r.plan->way->wheels[w].share, in_run[w], 1e-3);
    }
  }
}

// A base that turns slightly under control without feeding forward takes a little of the momentum.
TEST(WheelBudget, HoldsToControllerAccuracy) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = reaching();
  p.approach->base_control->feedforward = false;
  const double direct = largest_share(p, flown(p));
  plan_of(p).wheel_momentum = 0.9 * direct;
  const CaptureResult r = flown(p);
  std::printf("[ measured ] %.4f of what wheels can hold, %.4f allowed, %.4f without that\n", largest_share(p, r),
              0.9 * direct, direct);
  EXPECT_NEAR(largest_share(p, r), 0.9 * direct, 0.05 * direct);
  EXPECT_THAT(r.warnings,
              ::testing::Contains(HasSubstr("a robot that holds its base's attitude exactly; the simulated")));
}

// Wheels whose momenta do not add up to none at the start, so that what there is belongs to no motion of the joints.
TEST(WheelBudget, IncludesInitialMomentum) {
  CaptureProblem p = reaching();
  p.wheel_rate = {60, -10, 5, 30};
  plan_of(p).weights.emplace();
  plan_of(p).weights->excursion = 1, plan_of(p).weights->wheel_momentum = 1e-9;
  const CaptureResult r = flown(p);
  const std::vector<double> in_run = shares(p, r);
  for (std::size_t w = 0; w < in_run.size(); ++w) EXPECT_NEAR(r.plan->way->wheels[w].share, in_run[w], 1e-3);
  EXPECT_GT(in_run[0], 0.55);
}

TEST(WheelBudget, ObjectiveIsMinimalAndMatchesRun) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = reaching();
  p.wheel_rate.clear();
  const auto in_run = [&](const CaptureResult& r) {  // by the trapezoidal rule
    double sum = 0;
    const std::size_t end = last_sample(r, "approach");
    for (std::size_t i = 0; i <= end; ++i) {
      for (std::size_t w = 0; w < p.robot.wheels.size(); ++w) {
        const double share = value_at(r, "wheels/rate", i, static_cast<int>(w)) / p.robot.wheels[w].rate;
        sum += (i == 0 || i == end ? 0.5 : 1.0) * 0.5 * share * share;
      }
    }
    return sum / static_cast<double>(end);
  };
  const double direct = in_run(flown(p));
  plan_of(p).objective = Objective::wheel_momentum, plan_of(p).knots = 2;
  const CaptureResult r = flown(p);
  std::printf("[ measured ] %.6f, %.6f where joints move least\n", in_run(r), direct);
  EXPECT_NEAR(r.plan->objective_value, in_run(r), 1e-4 * in_run(r));
  EXPECT_LT(in_run(r), 0.8 * direct);
}

TEST(WheelBudget, InfeasibleBudgetReportsReason) {
  CaptureProblem p = reaching();
  plan_of(p).wheel_momentum = 0.3;
  EXPECT_THAT(simulate_capture(p).failure, HasSubstr("wheel 'wheel-1' needs 0.314159"));
  plan_of(p).wheel_momentum = 0.3143;
  plan_of(p).starts = 2;
  EXPECT_THAT(simulate_capture(p).failure, HasSubstr("of its momentum capacity at t = "));
  plan_of(p).wheel_momentum = 0.5;
  BaseControlSetup& control = *p.approach->base_control;
  control.feedforward = false, control.kp = {0.01, 0.01, 0.01}, control.kd = {0.01, 0.01, 0.01};
  EXPECT_THAT(simulate_capture(p).failure, HasSubstr("approach.base_control is too weak to hold the attitude"));
}

// The controlled base comes to need a little more than the first plan allowed; the rest is planned all the same.
TEST(WheelBudget, DoesNotEndReplanning) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml",
                                   std::vector<Override>{{"approach.replan", "{every: 5}"}});
  p.impact.reset(), p.post_impact.reset();
  plan_of(p).wheel_momentum = 0.0955;
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_GT(r.navigation.size(), 8u);
  for (const auto& replan : r.navigation) EXPECT_TRUE(replan.failure.empty()) << replan.failure;
  const auto said = [&](const char* what) {
    return std::count_if(r.warnings.begin(), r.warnings.end(),
                         [&](const std::string& w) { return w.find(what) != std::string::npos; });
  };
  EXPECT_GE(said("replanned, wheel 'wheel-2' needs 0.09"), 1);
  EXPECT_EQ(said("in a simulation with exact joint tracking"), 1);
}

TEST(PlannedBase, HoldsAttitudeByGains) {
  BaseControlSetup control;
  const Symmetric3d inertia = Symmetric3d::diagonal(100, 200, 300);
  EXPECT_FALSE(keeps_attitude(control, inertia, 60));
  control.feedforward = true;
  EXPECT_FALSE(keeps_attitude(control, inertia, 60));  // nothing brings it back
  control.kp = {0.1, 0.1, 0}, control.kd = {0, 0, 1e-3};
  EXPECT_TRUE(keeps_attitude(control, inertia, 60));
  control.kd = {0, 0, 0};
  EXPECT_FALSE(keeps_attitude(control, inertia, 60));
  // J w^2 = 300 (2 pi/60)^2 = 3.29 N m
  control.feedforward = false, control.kp = {3.3, 3.3, 3.3};
  EXPECT_TRUE(keeps_attitude(control, inertia, 60));
  control.kp[2] = 3.2;
  EXPECT_FALSE(keeps_attitude(control, inertia, 60));
  EXPECT_TRUE(keeps_attitude(control, inertia, 61));
}

// What plans leave out is said.
TEST(PlannedBase, WarnsOfThrustersAndStraightIn) {
  CaptureProblem p = reaching();
  EXPECT_THAT(plan_approach(p, plan_targets(p)).warnings,
              ::testing::Not(Contains(HasSubstr("thrusters switch on and off"))));
  p.approach->base_control->actuators = BaseControlSetup::Actuators::thrusters;
  EXPECT_THAT(plan_approach(p, plan_targets(p)).warnings, Contains(HasSubstr("thrusters switch on and off")));
  CaptureProblem handles = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/dual-arm-satellite-handles.yaml");
  LoadSetup push;
  push.body = handles.robot.base, push.amplitude = {{0, 0, 0.05}, {0, 0.05, 0}};
  handles.loads.push_back(push);
  plan_of(handles).objective = Objective::as_found, plan_of(handles).base_turn = 1;
  const ApproachPlan plan = plan_approach(handles, plan_targets(handles));
  EXPECT_TRUE(plan.failure.empty()) << plan.failure;
  EXPECT_THAT(plan.warnings, Contains(HasSubstr("path constraints for a robot that has no loads")));
}

}  // namespace wheel_budget_test
}  // namespace grapnel::testing
