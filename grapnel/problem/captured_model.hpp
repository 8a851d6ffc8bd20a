#pragma once

/// @file
/// The system while grasps hold: each target hangs on the first arm that grasps it, every further grasp of it closes a
/// loop.

#include <span>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// A grasp of the problem that closes now: the end-effector's frame is kept where it is on the target. `free` is the
/// system in which all targets are free.
HeldGrasp hold_grasp(const CaptureProblem& problem, const CaptureSystem& free, const Kinematics& kinematics,
                     std::size_t grasp);

/// The same grasp as the impact sees it.
Grasp grasp_of(const HeldGrasp& grasp, const Kinematics& kinematics);

struct CapturedSystem {
  CaptureSystem system;
  State state;
};

/// Makes every grasped target a child of the body that grasps it first, in the relative pose that the grasp keeps: on a
/// fixed joint (rigid), a hinge about the grasp's axis, or a ball joint, at the grasp. Further grasps become closures.
/// `state` belongs to the free system, `grasps` are in its bodies; its velocities fit the grasps, and joints that are
/// new get the relative velocities.
CapturedSystem join_targets(const CaptureSystem& free, const State& state, std::span<const HeldGrasp> grasps);

/// The state of the free system at which its bodies are where the joined ones are, and move as they do.
State take_apart(const CaptureSystem& free, const CaptureSystem& joined, const State& state);

}  // namespace grapnel
