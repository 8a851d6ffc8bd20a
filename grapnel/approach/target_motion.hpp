#pragma once

/// @file
/// Target motion at the start and at the capture, and the resulting goals of a plan.

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

/// Propagates a target from t0 to t1 under gravity, its loads (2.13) and the field of an orbit. Without loads and orbit
/// the result is exact to rounding error, otherwise to the tolerances of `integration`. @throws std::runtime_error if
/// the integration fails. `each_step` may throw to end it.
TargetMotion propagate_target(const TargetSetup& target, const TargetMotion& at_t0, double t0, double t1,
                              const Vector3d& gravity, const IntegrationSetup& integration,
                              std::span<const LoadSetup> loads = {},
                              const std::function<void(double t)>& each_step = {},
                              const std::optional<OrbitSetup>& orbit = {});
/// As above, with the surroundings of a problem.
TargetMotion propagate_target(const CaptureProblem& problem, const TargetSetup& target, const TargetMotion& at_t0,
                              double t0, double t1, const std::function<void(double t)>& each_step = {});

/// Motion of a problem's targets at the start and at the capture time T.
struct TargetPlan {
  std::vector<TargetMotion> start;
  std::vector<TargetMotion> capture;
};
TargetPlan plan_targets(const CaptureProblem& problem, const std::function<void(double t)>& each_step = {});

// Converts a problem's grasps to planning goals.

/// One goal per grasp: its end-effector at its grasp point, for the target motion at the capture. `model` is the
/// servicer's.
std::vector<Goal> capture_goals(const CaptureProblem& problem, const Model& model, const TargetPlan& targets);

/// Likewise for the final straight approach; StraightGoal::target indexes CaptureProblem::targets.
std::vector<StraightGoal> straight_goals(const CaptureProblem& problem, const Model& model);

/// The demand on the final rates of an approach.
RateDemand rate_demand(const ApproachSetup& approach);

}  // namespace grapnel
