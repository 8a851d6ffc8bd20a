#pragma once

/// @file
/// Where the targets are at the start and at the instant of capture, and what that asks of a plan.

#include <functional>
#include <optional>
#include <span>

#include "grapnel/plan/goal.hpp"
#include "grapnel/plan/straight_in.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// Pose and twist (at the frame's origin, in W) of a target.
struct TargetMotion {
  Posed X_WT;
  Twistd V_WT;
};

/// A target's motion at time t1 from that at t0, under gravity, the loads that act on it (2.13), and the field near an
/// orbit. Without loads and orbit it is exact to rounding; with them to the tolerances of `integration`.
/// @throws std::runtime_error if the integration fails. `each_step` may throw to end it.
TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity, const IntegrationSetup& integration,
                              std::span<const LoadSetup> loads = {},
                              const std::function<void(double t)>& each_step = {},
                              const std::optional<OrbitSetup>& orbit = {});
/// The same in the surroundings of a problem.
TargetMotion propagate_target(const CaptureProblem& problem, const TargetSetup& target, const TargetMotion& at_t0,
                              double t0, double t1, const std::function<void(double t)>& each_step = {});

/// Motion of a problem's targets at the start and at the instant of capture T.
struct TargetPlan {
  std::vector<TargetMotion> start;
  std::vector<TargetMotion> capture;
};
TargetPlan plan_targets(const CaptureProblem& problem, const std::function<void(double t)>& each_step = {});

// From a problem's grasps to goals of planning.

/// One goal per grasp: its end-effector at its grasp point, the targets moving as at the capture. `model` is the
/// servicer's.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets);

/// The same for the last piece straight in; StraightGoal::target counts in CaptureProblem::targets.
std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model);

/// What the final rates of an approach are to do.
RateDemand rate_demand(const ApproachSetup& approach);

}  // namespace grapnel
