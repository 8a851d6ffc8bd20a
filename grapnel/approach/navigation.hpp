#pragma once

/// @file
/// Estimates of targets: the problem that the planner sees, the estimation errors, and the problem of the remaining
/// approach. Thread safety: pure functions.

#include <vector>

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/knowledge_result.hpp"

namespace grapnel {

/// Whether targets are estimated, or the approach is replanned.
bool navigates(const CaptureProblem& problem);

/// The problem with its targets at their estimated states: position + error, exp(error) R, velocities + errors, at the
/// time of the problem's initial state (20.5).
CaptureProblem estimated_problem(const CaptureProblem& problem);

/// Estimation errors, per target of the problem.
std::vector<EstimateReport> estimate_errors(const CaptureProblem& problem, const std::vector<TargetMotion>& estimated,
                                            const std::vector<TargetMotion>& truth);

/// The problem of the remaining approach from `time` on. It begins with the servicer's pose and velocity in `state`.
/// Its joints start at `joints` (per robot joint: the present reference), so that the reference is continuous. The
/// search starts at `planned` and takes the first solution. `attitude`: desired attitude of the base control.
CaptureProblem rest_of_approach(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                                double time, const std::vector<JointPoint>& joints, const std::vector<double>& planned,
                                const std::optional<Rotationd>& attitude);

}  // namespace grapnel
