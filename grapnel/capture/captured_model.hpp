#pragma once

/// @file
/// The system after the grips have closed: each target hangs on the arm that holds it.
/// Thread safety: pure functions.

#include <span>

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/constraint/grasp.hpp"

namespace grapnel {

struct CapturedSystem {
  CaptureSystem system;
  State state;
};

/// Makes every gripped target a child of the body that grips it, in the relative pose it has now: on a fixed joint
/// (rigid), a hinge about the grip's axis, or a ball joint, at the contact point. `state` is that after the impact, so
/// that the velocities fit the grips; joints that are new get the relative rates. Each target is gripped once.
CapturedSystem capture_targets(const CaptureProblem& problem, const CaptureSystem& before, const State& state,
                               std::span<const Grasp> grasps);

}  // namespace grapnel
