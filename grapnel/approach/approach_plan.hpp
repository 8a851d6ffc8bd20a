#pragma once

/// @file
/// The reference that the joints follow in the approach: segments from waypoint to waypoint, final joint values given
/// or found by planning, the last piece straight in along the approach direction.

#include <optional>

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

struct ApproachPlan {
  std::vector<JointTrajectory> joints;  // per robot joint, over [0, T]
  PlanReport report;
  std::vector<std::string> warnings;
  std::string failure;  // not empty: there is no approach, and why
};

/// Plans the approach of a problem whose targets move as `targets` says. The plan assumes that the joints follow it
/// exactly. With `detail` columns the base's way along the last segment is not looked at, if nothing depends on it.
/// `progress` is told how far it is; what it throws passes through. Ends as a failure where PlanSetup::max_evaluations
/// are reached. `begin`: when the problem's initial state holds and the plan begins; waypoints before it are not there
/// [s]. @throws std::runtime_error if an integration fails.
ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets,
                           CaptureDetail detail = CaptureDetail::full, const CaptureProgress& progress = {},
                           double begin = 0);

/// The same where nothing has to be worked out: final joint values and rates are stated, and there is one segment, or
/// the motion is stated piece by piece. Else nothing. `system`: of the problem, with or without targets. The base's way
/// is not looked at.
std::optional<ApproachPlan> stated_approach(const CaptureProblem& problem, const CaptureSystem& system);

}  // namespace grapnel
