/// Choice of the capture time: times against closed forms, early errors for unreachable targets, and equality with a
/// run at the stated time.

#include "grapnel/approach/capture_window.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "capture/recorded.hpp"
#include "grapnel/approach/reach_bound.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace capture_window_test {

using Choose = CaptureWindow::Choose;
using ::testing::HasSubstr;

constexpr double kLink = 1, kLinkMass = 2, kBaseMass = 90;

// A floating base with a three-link arm mounted at its centre of mass. The base rotates freely, so the arm reaches
// every point within the bound, which has a closed form.
CaptureProblem one_arm() {
  CaptureProblem p = thesis_case();
  p.name = "one arm";
  p.robot.bodies.clear();
  BodyDescription base;
  base.name = "base", base.mass = kBaseMass, base.inertia = Symmetric3d::diagonal(15, 15, 15);
  base.joint.name = "base", base.joint.type = JointType::free;
  p.robot.bodies.push_back(base);
  for (int k = 1; k <= 3; ++k) {
    BodyDescription link;
    link.name = "link-" + std::to_string(k);
    link.parent = p.robot.bodies.back().name;
    link.mass = kLinkMass, link.com = {kLink / 2, 0, 0};
    link.inertia = Symmetric3d::diagonal(0.01, 0.17, 0.17);
    if (k > 1) link.X_PF.p = {kLink, 0, 0};
    link.joint.name = "joint-" + std::to_string(k), link.joint.type = JointType::revolute;
    link.joint.axis = {0, 0, 1};
    p.robot.bodies.push_back(link);
  }
  EndEffectorSetup tip;
  tip.name = "tip", tip.body = "link-3", tip.X_BE.p = {kLink, 0, 0};
  p.robot.end_effectors = {tip};
  p.joint_position = {0.5, -0.8, 0.6};
  p.targets.resize(1), p.grasps.resize(1);
  p.targets[0].given_at = TargetSetup::Instant::start;
  p.grasps[0].end_effector = "tip";
  p.approach->final_position.clear();
  p.approach->match.reset();
  p.approach->final_rates = std::vector<double>(3, 0.0);
  p.approach->profile = JointProfile::quintic;
  p.approach->plan.emplace();
  p.approach->duration = 0;
  p.impact.reset();
  return p;
}

// Reach of the straight arm from the centre of mass of the servicer.
double arms_reach() { return 3 * kLink - kLinkMass * (0.5 + 1.5 + 2.5) * kLink / (kBaseMass + 3 * kLinkMass); }

// The servicer's centre of mass at the start.
Vector3d center(const CaptureProblem& p) {
  const CaptureSystem servicer = make_servicer(p);
  const State state = initial_servicer_state(p, servicer);
  const std::array<int, 1> root = {servicer.base};
  return center_of_mass(servicer.model, forward_kinematics(servicer.model, state), root);
}

// A grasp point 4 m from the axis of a rotating target at 6 m: within reach during part of every turn. Returns the
// first time within reach.
double set_coming_round(CaptureProblem& p) {
  constexpr double kAway = 6, kArm = 4, kRate = 0.1;
  const double R = arms_reach();
  TargetSetup& target = p.targets[0];
  target.X_WT.p = center(p) + Vector3d{kAway, 0, 0};
  target.V_WT = {{0, 0, kRate}, {0, 0, 0}};
  target.grasp_points[0].X_TG.p = {kArm, 0, 0};
  const double away = std::acos((R * R - kAway * kAway - kArm * kArm) / (2 * kAway * kArm));
  return away / kRate;
}

CaptureProblem coming_round(double& expected) {
  CaptureProblem p = one_arm();
  expected = set_coming_round(p);
  p.approach->window = CaptureWindow{20, 32, 1, Choose::soonest};
  return p;
}

bool same_points(const WindowReport& a, const WindowReport& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return a.time == b.time && a.not_before == b.not_before &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
                    [&](const WindowPoint& x, const WindowPoint& y) {
                      return x.time == y.time && x.reachable == y.reachable && x.reason == y.reason &&
                             same(x.objective, y.objective) && x.speed == y.speed &&
                             same(x.direction_angle, y.direction_angle) && x.reach_share == y.reach_share;
                    });
}

TEST(CaptureWindow, SoonestTimeMatchesClosedForm) {
  double expected = 0;
  const CaptureProblem p = coming_round(expected);
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  std::printf("[ measured ] expected %.7f, not before %.7f, soonest %.7f s\n", expected,
              chosen.window.not_before.value_or(0), chosen.window.time);
  ASSERT_TRUE(chosen.window.not_before);
  EXPECT_LE(*chosen.window.not_before, expected + 1e-9);
  EXPECT_GT(*chosen.window.not_before, expected - 1e-5);
  // A stretched arm is singular: the chosen time is slightly later.
  EXPECT_GT(chosen.window.time, expected);
  EXPECT_LT(chosen.window.time, expected + 3e-3);
  EXPECT_EQ(chosen.problem.approach->duration, chosen.window.time);
  EXPECT_FALSE(chosen.problem.approach->window);
  // The points are in the order of time, including both ends, and unreachable ones are marked.
  const std::vector<WindowPoint>& points = chosen.window.points;
  EXPECT_EQ(points.front().time, 20);
  EXPECT_EQ(points.back().time, 32);
  int reached = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) {
      EXPECT_GT(points[i].time, points[i - 1].time);
    }
    const double distance =
        norm(Vector3d{6 + 4 * std::cos(0.1 * points[i].time), 4 * std::sin(0.1 * points[i].time), 0});
    EXPECT_NEAR(points[i].reach_share, distance / arms_reach(), 1e-12);
    EXPECT_NEAR(points[i].speed, 0.4, 1e-12);
    if (points[i].time < expected) {
      EXPECT_THAT(points[i].reason, HasSubstr("from the servicer's centre of mass"));
    }
    EXPECT_EQ(points[i].reachable, points[i].reason.empty());
    reached += points[i].reachable;
  }
  const auto first = std::find_if(points.begin(), points.end(), [](const WindowPoint& x) { return x.reachable; });
  EXPECT_EQ(first->time, chosen.window.time);
  EXPECT_EQ(reached, points.end() - first);  // all later points are reachable
}

// A common drift of servicer and target does not change the capture time, apart from rounding error in the other frame.
TEST(CaptureWindow, CommonDriftDoesNotChangeTime) {
  double expected = 0;
  CaptureProblem p = coming_round(expected);
  const Vector3d drift{0.3, -0.2, 0}, place{5, 7, 0};
  p.X_WB.p = place;
  p.V_WB = Twistd{{0, 0, 0}, drift};
  p.targets[0].X_WT.p += place;
  p.targets[0].V_WT.linear = drift;
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  EXPECT_NEAR(*chosen.window.not_before, expected, 1e-5);
  EXPECT_GT(chosen.window.time, expected);
  EXPECT_LT(chosen.window.time, expected + 3e-3);
  EXPECT_NEAR(chosen.window.points.front().speed, 0.4, 1e-12);
}

// A target state given at capture is the same for every capture time: only the servicer's motion changes.
TEST(CaptureWindow, TargetGivenAtCapture) {
  CaptureProblem p = one_arm();
  const Vector3d drift{0.2, 0, 0};
  p.V_WB = Twistd{{0, 0, 0}, drift};
  p.targets[0].given_at = TargetSetup::Instant::capture;
  p.targets[0].X_WT.p = center(p) + Vector3d{7, 0, 0};
  p.targets[0].grasp_points[0].X_TG.p = {0, 0, 0};
  p.approach->window = CaptureWindow{10, 30, 2, Choose::soonest};
  const double expected = (7 - arms_reach()) / 0.2;
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  EXPECT_NEAR(*chosen.window.not_before, expected, 1e-5);
  EXPECT_GT(chosen.window.time, expected);
  EXPECT_LT(chosen.window.time, expected + 6e-3);
}

// The target drifts with -v along y and rotates with w. Its grasp point at r from the axis is slowest when it lies
// along x and moves against the drift.
TEST(CaptureWindow, SlowestTimeMatchesClosedForm) {
  CaptureProblem p = one_arm();
  constexpr double kRate = 0.15, kArm = 0.5, kDrift = 0.02, kSlowest = 10.3;
  TargetSetup& target = p.targets[0];
  target.X_WT = {rotation_by({0, 0, -kRate * kSlowest}), center(p) + Vector3d{1.8, 0.2, 0}};
  target.V_WT = {{0, 0, kRate}, {0, -kDrift, 0}};
  target.grasp_points[0].X_TG.p = {kArm, 0, 0};
  p.approach->window = CaptureWindow{4, 20, 1, Choose::slowest};
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  std::printf("[ measured ] slowest at %.6f s\n", chosen.window.time);
  EXPECT_NEAR(chosen.window.time, kSlowest, 1.5e-3);
  for (const WindowPoint& point : chosen.window.points) EXPECT_TRUE(point.reachable) << point.time;
  EXPECT_FALSE(chosen.window.not_before);  // distances allow it from the beginning
}

// The chosen time has the minimum objective, compared with all sampled times and with nearby times.
TEST(CaptureWindow, ObjectiveIsMinimalAtChosenTime) {
  CaptureProblem p = one_arm();
  p.targets[0].X_WT = {rotation_by({0, 0, 1}), center(p) + Vector3d{2.2, 0.3, 0}};
  p.targets[0].V_WT = {{0, 0, 0.2}, {0, 0, 0}};
  p.approach->window = CaptureWindow{2, 34, 2, Choose::objective};
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  const auto objective_at = [&](double t) {
    CaptureProblem at = p;
    at.approach->window.reset(), at.approach->duration = t;
    return simulate_capture(at, {}, CaptureDetail::columns).plan->objective_value;
  };
  const double least = objective_at(chosen.window.time);
  EXPECT_GT(chosen.window.time, 2);
  EXPECT_LT(chosen.window.time, 34);
  for (const WindowPoint& point : chosen.window.points) {
    if (point.time == chosen.window.time) {
      EXPECT_EQ(point.objective, least);
    }
    EXPECT_GE(point.objective, least);
  }
  for (double t = chosen.window.time - 0.1; t < chosen.window.time + 0.1; t += 0.02)
    EXPECT_GE(objective_at(t), least - 1e-6) << t;
}

TEST(CaptureWindow, RunEqualsRunAtChosenTime) {
  double expected = 0;
  CaptureProblem p = coming_round(expected);
  p.X_WB.p = {31.7, -22.3, 0.4};  // planned in a frame other than W
  set_coming_round(p);
  p.approach->window->choose = Choose::objective;
  p.output_interval = 0.5;
  const CaptureResult r = simulate_capture(p), again = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  expect_passes(r);
  ASSERT_TRUE(r.plan && r.plan->window);
  EXPECT_TRUE(same_points(*r.plan->window, *again.plan->window));
  EXPECT_EQ(r.plan->final_position, again.plan->final_position);
  EXPECT_EQ(r.series.time.back(), r.plan->window->time);
  for (const WindowPoint& point : r.plan->window->points) {
    if (point.time != r.plan->window->time) continue;
    EXPECT_EQ(point.objective, r.plan->objective_value);  // bit for bit equal to the run's plan
  }

  CaptureProblem stated = p;
  stated.approach->window.reset();
  stated.approach->duration = r.plan->window->time;
  const CaptureResult s = simulate_capture(stated);
  ASSERT_EQ(s.status, CaptureStatus::completed) << s.failure;
  EXPECT_FALSE(s.plan->window);
  EXPECT_EQ(s.plan->final_position, r.plan->final_position);
  EXPECT_EQ(s.plan->objective_value, r.plan->objective_value);
  EXPECT_EQ(s.series.time, r.series.time);
  EXPECT_EQ(series(s, "joints/position").data, series(r, "joints/position").data);
  EXPECT_EQ(series(s, "base/position").data, series(r, "base/position").data);
  const std::size_t end = last_sample(r, "approach");
  EXPECT_LT(grasp_error(stated, r, 0, end).distance(), 1e-9);
}

// Replanning during the approach keeps the time of capture and its report.
TEST(CaptureWindow, ReplanningPreservesTime) {
  double expected = 0;
  CaptureProblem p = coming_round(expected);
  p.approach->window->choose = Choose::objective;
  p.targets[0].estimate.emplace();
  p.targets[0].estimate->position_error = {0.01, 0.02, 0};
  p.approach->replan = ReplanSetup{5, 0};
  const CaptureResult r = simulate_capture(p, {}, CaptureDetail::columns);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_GT(r.navigation.size(), 3u);
  ASSERT_TRUE(r.plan->window);
  EXPECT_EQ(r.approach_end->time, r.plan->window->time);
  // The plan uses the estimated target position.
  const double t = r.plan->window->points.front().time;
  const Vector3d seems{6 + 4 * std::cos(0.1 * t) + 0.01, 4 * std::sin(0.1 * t) + 0.02, 0};
  EXPECT_NEAR(r.plan->window->points.front().reach_share, norm(seems) / arms_reach(), 1e-12);
}

// The thesis's robot with a target that is always out of reach: the error is reported immediately, with the distance
// and the times.
TEST(CaptureWindow, UnreachableReportedImmediately) {
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  for (TargetSetup& target : p.targets) target.given_at = TargetSetup::Instant::start;
  p.targets[1].X_WT.p = {-9, -2, 0};
  p.targets[1].V_WT.linear = {0.05, 0, 0};
  p.approach->window = CaptureWindow{5, 40, 0, Choose::objective};
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult r = simulate_capture(p);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("[ measured ] %.3f s: %s\n", took, r.failure.c_str());
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(
      r.failure,
      HasSubstr("no capture can be planned between t = 5 and 40 s; the distance rules out any capture before t = "));
  EXPECT_THAT(r.failure, HasSubstr("grasp point 'grasp' of 'target-2' is"));
  EXPECT_LT(took, 1);
  ASSERT_TRUE(r.plan && r.plan->window);
  EXPECT_TRUE(std::isnan(r.plan->window->time));
  EXPECT_EQ(r.plan->window->points.size(), 51u);
  // The target comes within reach after the window: the earliest time lies beyond it.
  ASSERT_TRUE(r.plan->window->not_before);
  EXPECT_GT(*r.plan->window->not_before, 40);
  EXPECT_LT(*r.plan->window->not_before, 400);
}

// Within reach by distance but not with these joint limits: the error states the planner's reason, in about one second.
TEST(CaptureWindow, InfeasiblePlanReportedSoon) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = thesis_case();
  p.approach->final_position.clear();
  p.approach->plan.emplace();
  p.targets[0].given_at = TargetSetup::Instant::start;
  for (std::size_t j = 0; j < p.joint_position.size(); ++j) {
    JointLimits& limits = p.robot.bodies[j + 1].joint.limits;
    limits.lower = p.joint_position[j] - 0.5, limits.upper = p.joint_position[j] + 0.5;
  }
  p.targets.resize(1), p.grasps.resize(1);
  p.targets[0].X_WT.p = {-2.2, 0, 0};  // behind the robot
  p.approach->window = CaptureWindow{10, 30, 0, Choose::objective};
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult r = simulate_capture(p);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("[ measured ] %.3f s: %s\n", took, r.failure.c_str());
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_THAT(r.failure, HasSubstr("the closest attempt: planning the approach: end-effector 'tip-1'"));
  EXPECT_LT(took, 2);  // measured 0.1
  ASSERT_TRUE(r.plan && r.plan->window);
  EXPECT_FALSE(r.plan->found);
  EXPECT_FALSE(r.plan->miss.empty());
  for (const WindowPoint& point : r.plan->window->points) EXPECT_LT(point.reach_share, 1);
}

// A grasp point on a wheel that rotates in front of the arm, with its approach direction inward along the spoke:
// accessible while it faces the arm.
TEST(CaptureWindow, OppositeDirectionIsNotFree) {
  CaptureProblem p = one_arm();
  p.robot.end_effectors[0].approach_axis = Vector3d{1, 0, 0};
  constexpr double kAway = 2, kArm = 0.4, kRate = 0.2;
  p.targets[0].X_WT.p = Vector3d{kAway, 0, 0};
  p.targets[0].V_WT = {{0, 0, kRate}, {0, 0, 0}};
  p.targets[0].grasp_points[0].X_TG.p = {kArm, 0, 0};
  p.targets[0].grasp_points[0].approach_direction = Vector3d{-1, 0, 0};
  p.grasps[0].orientation = GraspSetup::Orientation::axis;
  p.approach->window = CaptureWindow{5, 20, 1, Choose::soonest};
  // Spoke at angle a: accessible from where the spoke is perpendicular to the line from the joint at the origin.
  const double expected = std::acos(-kArm / kAway) / kRate;
  const CaptureTime chosen = choose_capture_time(p);
  ASSERT_EQ(chosen.failure, "");
  std::printf("[ measured ] expected %.5f, soonest %.5f s\n", expected, chosen.window.time);
  for (const WindowPoint& point : chosen.window.points) {
    const double a = kRate * point.time;
    const Vector3d offset{kAway + kArm * std::cos(a), kArm * std::sin(a), 0}, inward{-std::cos(a), -std::sin(a), 0};
    EXPECT_NEAR(point.direction_angle, std::acos(dot(offset, inward) / norm(offset)), 1e-9);
    const bool away = point.direction_angle > 0.5 * std::numbers::pi;
    EXPECT_EQ(point.reason.find("approach direction of grasp point") != std::string::npos, away) << point.time;
  }
  EXPECT_GE(chosen.window.time, expected);
  // Without a required orientation the direction has no effect.
  p.grasps[0].orientation = GraspSetup::Orientation::free;
  const CaptureTime any = choose_capture_time(p);
  EXPECT_EQ(any.window.time, 5);
  EXPECT_GT(any.window.points.front().direction_angle, 0.5 * std::numbers::pi);
}

// If external forces move the servicer, momentum does not determine its position, and distances exclude nothing.
TEST(CaptureWindow, PushedServicerIsNotExcludedByDistance) {
  double expected = 0;
  CaptureProblem p = coming_round(expected);
  p.approach->window = CaptureWindow{24, 26, 1, Choose::soonest};
  p.loads.resize(1);
  p.loads[0].body = "base";
  p.loads[0].amplitude.linear = {1e-6, 0, 0};
  const CaptureTime chosen = choose_capture_time(p);
  EXPECT_FALSE(chosen.window.not_before);
  for (const WindowPoint& point : chosen.window.points) {
    EXPECT_GT(point.reach_share, 1);
    EXPECT_THAT(point.reason, ::testing::StartsWith("planning the approach"));
  }
  EXPECT_THAT(chosen.failure, HasSubstr("the closest attempt: planning the approach"));
}

// For any configuration and attitude of a robot, the distance of a frame is within the bound.
TEST(ReachBound, HoldsForAnyConfiguration) {
  int checked = 0;
  double largest = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(1000 + i);
    const CaptureProblem p = random_capture(i);
    const CaptureSystem servicer = make_servicer(p);
    const Model& model = servicer.model;
    const std::array<int, 1> root = {servicer.base};
    for (const int frame : servicer.end_effectors) {
      const ReachBound floats = reach_bound(model, servicer.base, frame, true);
      const ReachBound still = reach_bound(model, servicer.base, frame, false);
      if (!std::isfinite(floats.length)) continue;
      for (int k = 0; k < 50; ++k) {
        State state = initial_servicer_state(p, servicer);
        for (int j : servicer.robot_joints) {
          const Body& body = model.bodies()[model.joints()[j]];
          const JointLimits& limits = body.description.joint.limits;
          const double most = slides_along_axis(body.description.joint.type) ? 1e300 : std::numbers::pi;
          state.q[body.q] = random.uniform(std::max(limits.lower, -most), std::min(limits.upper, most));
        }
        const Kinematics now = forward_kinematics(model, state);
        const Vector3d end_effector = frame_pose(model, now, frame).p;
        const double away = norm(end_effector - center_of_mass(model, now, root));
        EXPECT_LE(away, floats.length * (1 + 1e-12));
        EXPECT_LE(norm(end_effector - now.X_WB[servicer.base] * still.from), still.length * (1 + 1e-12));
        largest = std::max(largest, away / floats.length);
        ++checked;
      }
    }
  }
  std::printf("[ measured ] %d configurations, largest share %.3f\n", checked, largest);
  EXPECT_GT(checked, 500);
  EXPECT_GT(largest, 0.8);
}

TEST(ReachBound, StraightArmIsItsLength) {
  const CaptureProblem p = one_arm();
  const CaptureSystem servicer = make_servicer(p);
  const int frame = servicer.end_effectors[0];
  EXPECT_NEAR(reach_bound(servicer.model, servicer.base, frame, true).length, arms_reach(), 1e-14);
  EXPECT_NEAR(reach_bound(servicer.model, servicer.base, frame, false).length, 3 * kLink, 1e-14);
}

// Problems built by a program, without the checks of the scenario reader.
TEST(CaptureWindow, RejectsContradictions) {
  double expected = 0;
  const CaptureProblem good = coming_round(expected);
  const auto fault = [&](const auto& change) {
    CaptureProblem p = good;
    change(p);
    try {
      simulate_capture(p);
    } catch (const CaptureProblemError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(fault([](CaptureProblem& p) { p.approach->window->latest = 20; }),
              HasSubstr("window.latest is 20 [s], must be greater than 20"));
  EXPECT_THAT(fault([](CaptureProblem& p) { p.approach->plan.reset(); }), HasSubstr("needs plan"));
  EXPECT_THAT(fault([](CaptureProblem& p) {
                p.approach->waypoints.resize(1);
                p.approach->waypoints[0].time = 25;
                p.approach->waypoints[0].joints = {0, 0, 0};
              }),
              HasSubstr("waypoints[0].time is 25 [s], must be less than 20"));
}

}  // namespace capture_window_test
}  // namespace grapnel::testing
