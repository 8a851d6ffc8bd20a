#pragma once

/// @file
/// What the names in a grasp mean. For problems whose names have been checked (make_capture_system).
/// Thread safety: pure functions; references are into the problem.

#include "grapnel/capture/capture_problem.hpp"

namespace grapnel {

/// Position of a target in CaptureProblem::targets.
std::size_t target_index(const CaptureProblem& problem, const std::string& target);
const TargetSetup& target_of(const CaptureProblem& problem, const GraspSetup& grasp);
const GraspPoint& grasp_point_of(const CaptureProblem& problem, const GraspSetup& grasp);
const EndEffectorSetup& end_effector_of(const CaptureProblem& problem, const GraspSetup& grasp);

}  // namespace grapnel
