#pragma once

/// @file
/// The system while grasps hold: each target hangs on the first arm that grasps it, and each further grasp of it closes
/// a loop; and the frame in which a run is computed.

#include <span>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// A grasp of the problem that closes now: the end-effector keeps its pose relative to the target. `free` is the system
/// in which all targets are free.
HeldGrasp hold_grasp(const CaptureProblem& problem, const CaptureSystem& free, const Kinematics& kinematics,
                     std::size_t grasp);

/// The same grasp for the impact.
Grasp grasp_of(const HeldGrasp& grasp, const Kinematics& kinematics);

struct CapturedSystem {
  CaptureSystem system;
  State state;
};

/// Makes each grasped target a child of the body that grasps it first, in the relative pose at closing: on a fixed
/// joint (rigid), a hinge about the grasp's axis, or a ball joint, at the grasp. Further grasps become closures.
/// `state` belongs to the free system, and `grasps` refer to its bodies. Its velocities satisfy the grasps; new joints
/// get the relative velocities. `slips` refer to the same bodies, and are added to the system.
CapturedSystem join_targets(const CaptureSystem& free, const State& state, std::span<const HeldGrasp> grasps,
                            std::span<const SlippingGrasp> slips = {});

/// The state of the free system with the poses and velocities of the joined bodies.
State take_apart(const CaptureSystem& free, const CaptureSystem& joined, const State& state);

// The frame in which a capture is computed. The physics does not depend on position or on a uniform motion of
// everything (an orbit's reference point moves along), but rounding errors do: at orbital velocity the relevant speeds
// are a millionth of those in W. A run is therefore computed in a frame with W's axes that begins at the base and keeps
// the base's initial velocity; its results are converted to W.

struct MovingFrame {
  Vector3d origin = Vector3d::zero();    // at t = 0, in W [m]
  Vector3d velocity = Vector3d::zero();  // in W [m/s]
  bool is_world() const { return dot(origin, origin) == 0 && dot(velocity, velocity) == 0; }
  Vector3d place(double time) const { return origin + time * velocity; }
};

/// For a base that is held or fixed, the frame does not move; with obstacles it is W.
MovingFrame moving_frame(const CaptureProblem& problem);

/// The problem in that frame.
CaptureProblem seen_from(const MovingFrame& frame, CaptureProblem problem);

/// Converts results from the frame to W. `momentum`, `mass`: of everything, in the frame, for the kinetic energies.
void to_world(const MovingFrame& frame, PhaseEnd& end);
void to_world(const MovingFrame& frame, const Vector3d& momentum, double mass, ImpactReport& report);
void to_world(const MovingFrame& frame, double time, Kinematics& kinematics);

}  // namespace grapnel
