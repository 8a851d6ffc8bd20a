#pragma once

/// @file
/// The pairs of bodies of a problem whose clearance is observed.

#include <vector>

#include "grapnel/contact/clearance_model.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// Bodies attached to this one by fixed joints.
std::vector<int> tied_to(const Model& model, int body);
/// Bodies rigidly attached to a grasp's end-effector, and other segments of those links.
std::vector<int> gripper_bodies(const CaptureSystem& system, const GraspSetup& grasp);
/// The clearance model of CaptureProblem::clearance in a model of the problem, captured targets included. `checked`:
/// per grasp, whether its end-effector is also checked against its target; empty: none.
ClearanceModel make_clearance_model(const CaptureProblem& problem, const CaptureSystem& system,
                                    const std::vector<bool>& checked = {});
/// The pairs of such a model that are the end-effector and the target of a checked grasp.
std::vector<int> gripper_pairs(const CaptureProblem& problem, const CaptureSystem& system, const ClearanceModel& model,
                               const std::vector<bool>& checked);

}  // namespace grapnel
