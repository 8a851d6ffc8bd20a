#include "grapnel/campaign/case_pool.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace grapnel {
namespace slow_run_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

CaptureProblem stiff_problem() {
  CaptureProblem problem;
  BodyDescription body;
  body.joint.friction = {0.5, 0.2, 1e-6};
  problem.robot.bodies.push_back(body);
  problem.approach.emplace();
  problem.approach->duration = 20;
  problem.approach->tracking.mode = JointControl::pd;
  problem.approach->tracking.kp = {100, 4e7};
  problem.approach->tracking.kd = {10, 20};
  problem.impact.emplace();
  problem.post_impact.emplace();
  problem.post_impact->duration = 50;
  return problem;
}

CaptureResult run_of(long approach, long afterwards) {
  CaptureResult result;
  result.approach_end.emplace();
  result.approach_end->time = result.capture_time = 20;
  result.post_impact_end.emplace();
  result.post_impact_end->time = 70;
  for (const auto& [phase, steps] : {std::pair{"approach", approach},
                                     {"post_impact", afterwards / 2},
                                     {"post_impact_2", afterwards - afterwards / 2}}) {
    PhaseCost cost;
    cost.phase = phase;
    cost.steps = steps;
    cost.rejected = 3;
    result.cost.push_back(cost);
  }
  return result;
}

TEST(SlowRun, MostRunsAreNotSlow) {
  EXPECT_THAT(slow_phases(stiff_problem(), run_of(14'000, 4'000)), IsEmpty());
  EXPECT_THAT(slow_phases(stiff_problem(), run_of(19'999, 49'000)), IsEmpty());
  EXPECT_THAT(slow_phases({}, {}), IsEmpty());
}

TEST(SlowRun, NamesPhaseAndSettings) {
  const auto lines = slow_phases(stiff_problem(), run_of(60'000, 70'000));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[0], HasSubstr("approach took 60000 steps for 20 s of motion (3 more were rejected)"));
  EXPECT_THAT(lines[0], HasSubstr("first: dry friction with a transition rate of 1e-06 rad/s or m/s (a larger "
                                  "friction.transition_rate of the robot's joints); controllers with kp up to 4e+07"));
  EXPECT_THAT(lines[1], HasSubstr("post_impact took 70000 steps for 50 s of motion (6 more were rejected)"));
  EXPECT_THAT(lines[1], ::testing::Not(HasSubstr("controllers")));
}

// Joints held by drives have no friction to resolve, and ideal tracking has no controllers.
TEST(SlowRun, NamesOnlyPresentCauses) {
  CaptureProblem problem = stiff_problem();
  problem.approach->tracking.mode = JointControl::prescribed;
  problem.post_impact->joints = PostImpactSetup::Joints::braked;
  problem.integration.relative_tolerance = 1e-14;
  for (const std::string& line : slow_phases(problem, run_of(60'000, 70'000)))
    EXPECT_THAT(line, HasSubstr("most likely first: a relative tolerance of 1e-14 (a larger "
                                "integration.relative_tolerance)"));
}

}  // namespace slow_run_test
}  // namespace grapnel
