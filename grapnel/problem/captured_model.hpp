#pragma once

/// @file
/// The system while grasps hold: each target hangs on the first arm that grasps it, every further grasp of it closes a
/// loop; and the frame in which all of a run is computed.

#include <span>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

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

// The frame in which a capture is computed. Nothing in it depends on where it happens or on a uniform motion of
// everything (an orbit's reference point is taken along), but rounding does: at orbital velocity the speeds that matter
// are a millionth of those in W. So a run is computed in a frame that has W's axes, begins at the base and goes on
// moving as the base begins to, and what it finds is told in W.

struct MovingFrame {
  Vector3d origin = Vector3d::zero();    // at t = 0, in W [m]
  Vector3d velocity = Vector3d::zero();  // in W [m/s]
  bool is_world() const { return dot(origin, origin) == 0 && dot(velocity, velocity) == 0; }
  Vector3d place(double time) const { return origin + time * velocity; }
};

/// A base that is held or fixed does not move, and its frame does not either.
MovingFrame moving_frame(const CaptureProblem& problem);

/// The problem in that frame.
CaptureProblem seen_from(const MovingFrame& frame, CaptureProblem problem);

/// What was found in the frame, in W. `momentum`, `mass`: of everything, in the frame, for the kinetic energies.
void to_world(const MovingFrame& frame, PhaseEnd& end);
void to_world(const MovingFrame& frame, const Vector3d& momentum, double mass, ImpactReport& report);
void to_world(const MovingFrame& frame, double time, Kinematics& kinematics);

}  // namespace grapnel
