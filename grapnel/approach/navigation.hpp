#pragma once

/// @file
/// Estimates of targets: the problem that an approach is planned on, how far it is from the truth, and the problem of
/// what is left of an approach. Thread safety: free functions of their arguments.

#include <vector>

#include "grapnel/approach/target_motion.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/knowledge_result.hpp"

namespace grapnel {

/// Whether targets are estimated, or the approach is replanned.
bool navigates(const CaptureProblem& problem);

/// The problem with its targets where they are estimated to be: position + error, exp(error) R, velocities + errors, at
/// the instant at which the problem gives them (20.5).
CaptureProblem estimated_problem(const CaptureProblem& problem);

/// Estimates against the truth, per target of the problem.
std::vector<EstimateReport> estimate_errors(const CaptureProblem& problem, const std::vector<TargetMotion>& estimated,
                                            const std::vector<TargetMotion>& truth);

/// The problem of what is left of an approach at `time`: it begins where the servicer of `state` then is, moving as it
/// does, with joints that leave from `joints` (per robot joint: what they follow), so that what they are to follow is
/// continuous. The search begins at `planned` and takes the first solution. `attitude`: what the base's control keeps.
CaptureProblem rest_of_approach(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                                double time, const std::vector<JointPoint>& joints, const std::vector<double>& planned,
                                const std::optional<Rotationd>& attitude);

}  // namespace grapnel
