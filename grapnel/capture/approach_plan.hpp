#pragma once

/// @file
/// The reference that the joints follow in the approach: legs from waypoint to waypoint, final joint values given or
/// found by planning, the last piece straight in along the approach direction. Thread safety: pure functions.

#include "grapnel/capture/target_motion.hpp"
#include "grapnel/result/plan_report.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

struct ApproachPlan {
  std::vector<JointTrajectory> joints;  // per robot joint, over [0, T]
  PlanReport report;
  std::vector<std::string> warnings;
  std::string failure;  // not empty: there is no approach, and why
};

/// Plans the approach of a problem whose targets move as `targets` says. The plan assumes that the joints follow it
/// exactly. @throws std::runtime_error if an integration fails.
ApproachPlan plan_approach(const CaptureProblem& problem, const TargetPlan& targets);

}  // namespace grapnel
