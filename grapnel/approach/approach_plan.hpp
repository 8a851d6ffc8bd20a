#pragma once

/// @file
/// The reference trajectory of the joints during the approach: segments between waypoints, with final joint
/// values that are given or planned, and a final straight approach along the approach direction.

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
  std::string failure;  // not empty: no approach exists, with the cause
};

/// Plans the approach of a problem whose targets move as `targets` states. The plan assumes exact tracking by the
/// joints. With `detail` columns the base's path along the last segment is not evaluated, unless something depends on
/// it. `progress` is called with the progress of the search; exceptions from it pass through. If
/// PlanSetup::max_evaluations is reached, the result is a failure. `begin`: time of the problem's initial state and
/// start of the plan [s]; earlier waypoints are skipped. @throws std::runtime_error if an integration fails.
ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets,
                           CaptureDetail detail = CaptureDetail::full, const CaptureProgress& progress = {},
                           double begin = 0);

/// As plan_approach(), for approaches without a search: final joint values and rates are stated and there is one
/// segment, or the motion is stated segment by segment. Otherwise empty. `system`: of the problem, with or without
/// targets. The base's path is not evaluated.
std::optional<ApproachPlan> stated_approach(const CaptureProblem& problem, const CaptureSystem& system);

}  // namespace grapnel
