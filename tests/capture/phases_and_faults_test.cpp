/// Absent phases, failed runs, and problems with contradictory settings.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "capture/capture_case.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace phases_and_faults_test {

TEST(Phases, ApproachAlone) {
  CaptureProblem p = thesis_case_pd();
  p.impact.reset();
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_TRUE(r.approach_start && r.approach_end);
  EXPECT_FALSE(r.impact() || r.post_impact_end);
  EXPECT_THAT(r.series.phases, ::testing::ElementsAre("approach"));
  EXPECT_EQ(r.series.time.size(), 21u);
  for (const Series& s : r.series.series) EXPECT_EQ(s.data.size(), 21u * static_cast<std::size_t>(s.width())) << s.path;
  EXPECT_NO_THROW(check_time_series(r.series));
}

TEST(Phases, ApproachAloneWithUngraspedTargets) {
  CaptureProblem p = thesis_case_pd();
  p.impact.reset(), p.grasps.clear(), p.approach->match.reset();
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_EQ(r.approach_end->end_effectors[0].target, "");
  EXPECT_EQ(r.approach_end->targets.size(), 2u);
}

CaptureProblem impact_alone() {
  CaptureProblem p = thesis_case();
  p.joint_position = p.approach->final_position;
  p.X_WB = {rotation_about({0, 0, 1}, 0.6762), {0, 0.0194, 0}};
  p.approach.reset();
  return p;
}

TEST(Phases, ImpactAloneFromAStatedConfiguration) {
  CaptureProblem p = impact_alone();
  p.contact.gap = ContactSetup::Gap::translate_target;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_FALSE(r.approach_start || r.approach_end || r.post_impact_end);
  EXPECT_EQ(r.impact()->time, 0);
  EXPECT_THAT(r.series.time, ::testing::ElementsAre(0, 0));
  EXPECT_FALSE(row(r, "work_energy_residual").applies);
  // thesis-facts, end-effectors at rest, rigid.
  EXPECT_NEAR(r.impact()->grasps[0].impulse[0], -0.1290, 0.6e-4);
  EXPECT_NEAR(r.impact()->grasps[0].impulse[1], -0.0172, 0.6e-4);
  EXPECT_NEAR(r.impact()->grasps[0].angular_impulse[2], 0.1154, 0.6e-4);
}

TEST(Phases, ImpactAndMotionWithoutApproach) {
  CaptureProblem p = impact_alone();
  p.V_WB = Twistd{{0, 0, 0.02}, {0.01, 0, 0}};
  p.joint_rate = {0.1, 0, -0.1, 0.05, 0, 0};
  p.post_impact.emplace();
  p.post_impact->duration = 3;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_THAT(r.series.phases, ::testing::ElementsAre("contact", "post_impact"));
  EXPECT_EQ(r.post_impact_end->time, 3);
}

TEST(Phases, ReportsProgress) {
  CaptureProblem p = thesis_case_pd();
  p.post_impact.emplace();
  p.post_impact->duration = 4;
  std::vector<std::string> phases;
  double last = -1, end = 0;
  simulate_capture(p, [&](const std::string& phase, double time, double until) {
    if (phases.empty() || phases.back() != phase) {
      phases.push_back(phase);
      if (phase != "post_impact") last = -1;  // the planner counts evaluations, phases count seconds
    }
    EXPECT_GE(time, last);
    EXPECT_LE(time, until);
    last = time, end = until;
  });
  EXPECT_THAT(phases, ::testing::ElementsAre(kPlanning, "approach", "post_impact"));
  EXPECT_EQ(last, 24);
  EXPECT_EQ(end, 24);
}

TEST(Failure, InApproachRetainsResults) {
  CaptureProblem p = thesis_case_pd();
  p.approach->match.reset();
  for (TargetSetup& t : p.targets) t.V_WT = Twistd::zero();
  p.integration.max_step = 0.01, p.integration.max_steps = 1000;  // sufficient for each integration of the planner
  p.output_interval = 0.1;
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::StartsWith("approach: "));
  EXPECT_THAT(r.failure, ::testing::ContainsRegex("[0-9]")) << "the time";
  std::printf("[ measured ] %s\n", r.failure.c_str());
  EXPECT_TRUE(r.approach_start);
  EXPECT_FALSE(r.approach_end || r.impact());
  EXPECT_GT(r.series.time.size(), 2u);
  EXPECT_LT(r.series.time.back(), 20);
  EXPECT_NO_THROW(check_time_series(r.series));
  EXPECT_EQ(r.cost.at(0).steps + r.cost.at(0).rejected, 1000);
}

TEST(Failure, AfterTheImpactRetainsApproachAndImpact) {
  CaptureProblem p = thesis_case();
  p.approach->duration = 1;
  p.approach->match.reset();
  p.targets[0].V_WT.angular = {0.5, 0.3, 1.2};
  p.targets[0].inertia = Symmetric3d::diagonal(1, 1.5, 2);
  p.post_impact.emplace();
  p.post_impact->duration = 100;
  const CaptureResult whole = simulate_capture(p);
  expect_passes(whole);
  ASSERT_GT(whole.cost.at(1).steps, whole.cost.at(0).steps + 10);
  p.integration.max_steps = whole.cost.at(1).steps - 5;
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::StartsWith("post_impact: "));
  EXPECT_TRUE(r.approach_end && r.impact());
  EXPECT_FALSE(r.post_impact_end);
  EXPECT_EQ(norm(r.impact()->grasps[0].impulse - whole.impact()->grasps[0].impulse), 0);
  EXPECT_GT(r.series.time.back(), 2);
  EXPECT_LT(r.series.time.back(), 101);
  EXPECT_LT(row(r, "angular_momentum_drift").value, 1e-11);
}

TEST(Failure, InPlanningIsReported) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.targets[0].X_WT.p = {9, 0, 0};
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::StartsWith("planning the approach: ")) << r.failure;
  EXPECT_THAT(r.failure, ::testing::HasSubstr("end-effector 'tip-1' comes no closer than")) << r.failure;
  EXPECT_TRUE(r.series.time.empty());
  EXPECT_FALSE(r.approach_start || r.impact());
  ASSERT_TRUE(r.plan);
  EXPECT_FALSE(r.plan->found);
  EXPECT_GT(r.plan->miss.at(0).distance, 5);
}

TEST(Failure, NamesTarget) {
  CaptureProblem p = thesis_case();
  p.integration.max_steps = 2;
  p.targets[1].V_WT.angular = {0.3, 0.4, 3};
  p.targets[1].inertia = Symmetric3d::diagonal(1, 1.5, 2);
  p.targets[0].V_WT = Twistd::zero();
  LoadSetup push;  // a loaded target is integrated with the run's settings
  push.body = BodyName::of_target(1);
  push.amplitude.linear = {1, 0, 0};
  p.loads.push_back(push);
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, ::testing::StartsWith("propagating target 'target-")) << r.failure;
}

std::vector<std::string> faults(const CaptureProblem& p) {
  try {
    simulate_capture(p);
  } catch (const CaptureProblemError& error) {
    std::vector<std::string> lines;
    std::istringstream text(error.what());
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  return {};
}

TEST(Faults, AllListed) {
  CaptureProblem p = thesis_case_pd();
  p.grasps[0].end_effector = "hand";
  p.grasps[1].target = "moon";
  p.joint_position.pop_back();
  p.approach->duration = 0;
  p.approach->tracking.kd.push_back(1);
  p.impact->duration = 0;
  p.V_WB = Twistd::zero();
  p.momentum = Momentumd::zero();
  p.post_impact.emplace();
  EXPECT_THAT(faults(p),
              ::testing::UnorderedElementsAre(
                  "grasp: unknown end-effector 'hand'", "grasp: unknown target 'moon'",
                  "initial joint positions: 5 values for 6 joints", "approach: duration must be positive",
                  "approach: kd: 7 values for 6 joints", "impact: duration must be positive",
                  "post_impact: duration must be positive", "initial: give the base's twist or the momentum, not both",
                  "no grasp names target 'target-2'"));
}

TEST(Faults, EachIsFound) {
  const auto fault = [](auto&& change) {
    CaptureProblem p = thesis_case_pd();
    p.post_impact.emplace();
    p.post_impact->duration = 1;
    change(p);
    const std::vector<std::string> found = faults(p);
    return found.size() == 1 ? found[0] : std::to_string(found.size()) + " faults";
  };
  EXPECT_EQ(fault([](CaptureProblem&) {}), "0 faults");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.grasps[1].grasp_point = "ear"; }),
            "grasp: target 'target-2' has no grasp point 'ear'");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.grasps[1].end_effector = "tip-1"; }),
            "end-effector 'tip-1' in grasps[1] is used twice; first in grasps[0]");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.grasps[1].model = GraspModel::hinge, p.grasps[1].hinge_axis = {0, 0, 2};
            }),
            "grasp of 'tip-2': hinge axis must be a unit vector");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.approach->final_position.clear(); }),
            "approach: final joint positions: 0 values for 6 joints");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.approach->final_position[2] = NAN; }),
            "approach: final joint positions: a value is not finite");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.post_impact->duration = INFINITY; }),
            "post_impact: duration must be positive");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.impact.reset(); }),
            "motion is for scenarios without grasps: after a capture, give 'impact' and 'post_impact'");
  EXPECT_EQ(
      fault(
          [](CaptureProblem& p) { p.approach->tracking.mode = JointControl::prescribed, p.joint_rate.assign(6, 0.1); }),
      "approach.profile: the quartic profile starts from rest; with initial.joint_rates use quintic or cycloidal");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.robot.base_mode = RobotSetup::Base::held, p.V_WB = Twistd{{0, 0, 1}, {0, 0, 0}};
            }),
            "initial.base.angular_velocity: the robot's base is held, so its motion cannot be stated");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.grasps[1].closes = GraspSetup::Closes::at_time, p.grasps[1].closes_at = 71;
              p.post_impact->duration = 50;
            }),
            "grasps[1].closes_at is 71 [s], must be at most 70, the end of post_impact");
  EXPECT_EQ(fault([](CaptureProblem& p) { p.grasps[1].closes = GraspSetup::Closes::on_arrival; }),
            "grasps[1].closes_on_arrival needs an 'envelope' at end-effector 'tip-2'");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.post_impact->releases = {{60, {}}};
            }),
            "post_impact.release[0].after is 60 [s], must be less than 1, post_impact's duration");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.post_impact->releases = {{0.5, {"tip-3"}}};
            }),
            "post_impact: release of 'tip-3', which has no grasp");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.impact->law = ImpactSetup::Law::as_published, p.grasps[1].model = GraspModel::point;
            }),
            "impact.law: as_published is not defined for grasps[1], which is not rigid; use plastic");
  EXPECT_EQ(fault([](CaptureProblem& p) {
              p.integration.loops = IntegrationSetup::Loops::baumgarte, p.integration.baumgarte_time = 0;
            }),
            "integration: baumgarte_time must be positive");
}

TEST(Faults, NothingToDo) {
  CaptureProblem p = thesis_case();
  p.approach.reset(), p.impact.reset();
  EXPECT_THAT(faults(p), ::testing::ElementsAre(
                             "nothing to simulate: state 'approach', 'impact' or both, or 'motion' without a capture"));
  p = thesis_case();
  p.grasps.clear(), p.targets.clear();
  EXPECT_THAT(faults(p),
              ::testing::ElementsAre("approach: matching rates needs grasps", "impact: there are no grasps"));
}

TEST(Faults, OfTheModelComeFromTheModel) {
  CaptureProblem p = thesis_case();
  p.robot.bodies[2].mass = -1;
  EXPECT_THROW(simulate_capture(p), ModelError);
}

}  // namespace phases_and_faults_test
}  // namespace grapnel::testing
