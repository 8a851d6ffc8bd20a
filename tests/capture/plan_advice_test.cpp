/// Planning errors for unsuitable starts, assignments of grasps, gains or bases; and plans near panels.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "capture/capture_case.hpp"
#include "capture/loop_case.hpp"
#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/result_table.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace plan_advice_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string plan_failure(const CaptureProblem& p) { return plan_approach(p, plan_targets(p)).failure; }

// --- Panels ---

TEST(PlansBesidePanels, ClearanceOfFlexiblePanels) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("dual-arm-satellite-panels.yaml");
  p.approach->plan->clearance = 0.02;
  const ApproachPlan plan = plan_approach(p, plan_targets(p));
  ASSERT_EQ(plan.failure, "");
  ASSERT_TRUE(plan.report.path && plan.report.path->clearance);
  EXPECT_GT(*plan.report.path->clearance, 0.02 - 1e-6);
}

// A panel at the capture position of an end-effector determines the plan's clearance. The panel's name contains special
// characters.
TEST(PlansBesidePanels, PanelPositions) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("dual-arm-tumbling-targets.yaml");
  p.approach->plan->clearance = 0.005;
  PanelSetup panel;
  panel.name = "wing ~1.é";
  panel.mass = 1e-3, panel.com = {0.4, 0, 0}, panel.inertia = Symmetric3d::diagonal(2e-5, 6e-5, 6e-5);
  Geometry plate{Geometry::Shape::box, {0.8, 0.3, 0.02}, Posed::identity()};
  plate.X_BG.p = {0.4, 0, 0};
  panel.geometry = {plate};
  panel.X_TP.p = {0.3, 0, 0};
  p.targets[0].panels = {panel};
  const ApproachPlan bare = plan_approach(p, plan_targets(p));
  ASSERT_EQ(bare.failure, "");
  // The same panel, far from its target, at the capture position of the second end-effector.
  const TargetPlan at = plan_targets(p);
  const Vector3d place = at.capture[1].X_WT * grasp_point_of(p, p.grasps[1]).X_TG.p;
  p.targets[0].panels[0].X_TP.p = inverse(at.capture[0].X_WT) * place - Vector3d{0.4, 0, 0};
  const std::string failure = plan_failure(p);
  EXPECT_THAT(failure, HasSubstr(p.targets[0].name + "/wing ~1.é"));
}

// Names of a robot's bodies and end-effectors may begin like those of targets in a model.
TEST(BodyNames, LinkWithPrefixOfTargets) {
  CaptureProblem p = scenario("dual-arm-tumbling-targets.yaml");
  RobotSetup& robot = p.robot;
  EndEffectorSetup& tip = robot.end_effectors[0];
  const std::string before = tip.body;
  tip.name = p.grasps[0].end_effector = tip.body = "target:";
  ASSERT_GT(norm(tip.X_BE.p), 0);
  for (BodyDescription& body : robot.bodies) {
    if (body.name == before) body.name = tip.body;
    if (body.parent == before) body.parent = tip.body;
  }
  for (auto& [body, shape] : robot.geometry) {
    if (body == before) body = tip.body;
  }
  const CaptureSystem system = make_capture_system(p);
  const int body = body_named(system, tip.body);
  ASSERT_GE(body, 0);
  EXPECT_EQ(shown_name(system, body), "target:");
  EXPECT_EQ(norm(own_frame(system, body).p), 0);
  const int target = body_named(system, BodyName::of_target(1));
  EXPECT_EQ(target, target_body_index(system, 1));
  EXPECT_EQ(shown_name(system, target), p.targets[1].name);
  EXPECT_EQ(body_named(system, p.targets[1].name), -1);
}

// Bodies keep their addresses when targets are joined to the arms, for any order of bodies in the models.
TEST(BodyAddresses, IdenticalInEveryModel) {
  const CaptureProblem p = scenario("dual-arm-satellite-panels.yaml");
  const CaptureSystem free = make_capture_system(p), servicer = make_servicer(p);
  const State state = initial_servicer_state(p, free);
  const std::vector<HeldGrasp> grasps = {hold_grasp(p, free, forward_kinematics(free.model, state), 0)};
  const CaptureSystem joined = join_targets(free, state, grasps).system;
  ASSERT_GT(bodies_of_target(free, 0).size(), 5u);  // measured 19: two panels of two segments each
  for (const CaptureSystem* other : {&joined, &servicer}) {
    for (std::size_t i = 0; i < free.model.bodies().size(); ++i) {
      const int same = body_at(*other, free.addresses[i]);
      if (other == &servicer && free.addresses[i].owner != BodyAddress::Owner::robot) {
        EXPECT_EQ(same, -1);
        continue;
      }
      ASSERT_GE(same, 0);
      EXPECT_EQ(other->model.bodies()[same].description.name, free.model.bodies()[i].description.name);
    }
  }
}

// --- The start ---

TEST(PlanAdvice, NamesPairsTooCloseAtStart) {
  CaptureProblem p = scenario("dual-arm-satellite-handles.yaml");
  p.approach->plan->clearance = 5;
  const CaptureResult r = simulate_capture(p);
  EXPECT_THAT(r.failure, AllOf(HasSubstr("at the start of the segment, t = 0 s"), HasSubstr(" m apart"),
                               HasSubstr("the minimum clearance is 5 m"), HasSubstr("initial.joints"),
                               HasSubstr("' and '"), Not(HasSubstr("more knots"))));
  EXPECT_THAT(result_table(r), Not(HasSubstr("nan")));
}

// --- Exchanged grasps ---

// Two planar arms, each with a target on its side. As the targets move outward, the exchanged grasps become unreachable
// before the stated ones do.
TEST(PlanAdvice, NamesExchangedGrasps) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear(), p.approach->plan.emplace();
  std::string failure;
  for (double outward = 1; outward < 1.6 && failure.empty(); outward += 0.05) {
    CaptureProblem stated = p;
    for (TargetSetup& target : stated.targets) target.X_WT.p = outward * target.X_WT.p;
    if (!plan_failure(stated).empty()) break;
    std::swap(stated.grasps[0].end_effector, stated.grasps[1].end_effector);
    failure = plan_failure(stated);
  }
  EXPECT_THAT(failure, AllOf(HasSubstr("the grasps are exchanged between end-effectors"),
                             HasSubstr("'tip-1' at grasp point 'grasp' of target 'target-1'"),
                             HasSubstr("'tip-2' at grasp point 'grasp' of target 'target-2'")));
  // The error gives no such advice for a target beyond the reach of both.
  p.targets[0].X_WT.p = 20.0 * p.targets[0].X_WT.p;
  EXPECT_THAT(plan_failure(p), AllOf(HasSubstr("closer to each other"), Not(HasSubstr("exchanged"))));
}

// --- The base ---

// A target beyond the arms' reach: a plan does not move the base there; a load can.
TEST(PlanAdvice, ReportsThatPlansDoNotMoveBase) {
  CaptureProblem p = scenario("dual-arm-satellite-handles.yaml");
  p.approach->straight_in.reset();
  for (TargetSetup& target : p.targets) target.X_WT.p[2] += 4;
  EXPECT_THAT(plan_failure(p), AllOf(HasSubstr("a plan moves the joints, and the base by their reactions only"),
                                     Not(HasSubstr("external_wrenches"))));
  LoadSetup load;
  load.body = p.robot.base, load.amplitude.linear = {0, 1, 0};
  load.profile.shape = LoadProfile::Shape::constant, load.profile.start = 0, load.profile.end = 45;
  p.loads = {load};
  EXPECT_THAT(plan_failure(p), HasSubstr("loads (external_wrenches) move the base by a further 0."));
}

// Flight beside a target under thrust: the planner finds a plan if a load moves the base into reach.
TEST(PlanAdvice, PlansIfLoadMovesBaseIntoReach) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("dual-arm-satellite-handles.yaml");
  p.approach->straight_in.reset();
  const CaptureResult near = simulate_capture(p);
  ASSERT_EQ(near.status, CaptureStatus::completed) << near.failure;
  // A force moves the servicer by 4 m until the capture; the targets get the same displacement and final speed.
  double mass = 0;
  for (const BodyDescription& body : p.robot.bodies) mass += body.mass;
  const double T = p.approach->duration, distance = 4;
  LoadSetup load;
  load.body = p.robot.base, load.amplitude.linear = {0, 0, 2 * mass * distance / (T * T)};
  load.profile.shape = LoadProfile::Shape::constant, load.profile.start = 0, load.profile.end = T;
  p.loads = {load};
  for (TargetSetup& target : p.targets) {
    target.X_WT.p[2] += distance;
    target.V_WT.linear[2] += 2 * distance / T;
  }
  const ApproachPlan plan = plan_approach(p, plan_targets(p));
  EXPECT_EQ(plan.failure, "");
  EXPECT_TRUE(plan.report.found);
}

// --- Gains ---

TEST(PlanAdvice, NamesGainsTooLargeForSampleTime) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = thesis_case();
  use_pd(p, 49, 40);
  p.approach->tracking.mode = JointControl::computed_torque;
  p.control.emplace();
  p.control->timing.period = 0.1;
  CaptureResult r = simulate_capture(p);
  const auto names_gain = AllOf(HasSubstr("approach.tracking: the sampled loop is unstable"), HasSubstr("kd T/I = 4"),
                                HasSubstr("control.period 0.1 s"));
  EXPECT_THAT(r.warnings, ::testing::Contains(names_gain));
  if (r.status == CaptureStatus::failed) {
    EXPECT_THAT(r.failure, names_gain);
  }
  p.approach->tracking.kd.assign(6, 14);
  r = simulate_capture(p);
  EXPECT_THAT(r.warnings, Not(::testing::Contains(HasSubstr("approach.tracking: the sampled loop"))));
}

}  // namespace plan_advice_test
}  // namespace grapnel::testing
