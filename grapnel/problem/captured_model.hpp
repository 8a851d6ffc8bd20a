#pragma once

/// @file
/// The system while grips hold: each target hangs on the first arm that grips it, every further grip of it closes a
/// loop.

#include <span>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/problem/capture_system.hpp"

namespace grapnel {

/// A grip of the problem that closes now: the end-effector's frame is kept where it is on the target. `free` is the
/// system in which all targets are free.
HeldGrasp hold_grasp(const CaptureProblem& problem, const CaptureSystem& free, const Kinematics& kinematics,
                     std::size_t grasp);

/// The same grip as the impact sees it.
Grasp grasp_of(const HeldGrasp& grip, const Kinematics& kinematics);

struct CapturedSystem {
  CaptureSystem system;
  State state;
};

/// Makes every gripped target a child of the body that grips it first, in the relative pose that the grip keeps: on a
/// fixed joint (rigid), a hinge about the grip's axis, or a ball joint, at the grip. Further grips become closures.
/// `state` belongs to the free system, `grips` are in its bodies; its velocities fit the grips, and joints that are new
/// get the relative rates.
CapturedSystem join_targets(const CaptureSystem& free, const State& state, std::span<const HeldGrasp> grips);

/// The state of the free system at which its bodies are where the joined ones are, and move as they do.
State take_apart(const CaptureSystem& free, const CaptureSystem& joined, const State& state);

}  // namespace grapnel
