#pragma once

/// @file
/// The frame in which a capture is computed. Nothing in it depends on where it happens or on a uniform motion of
/// everything, but rounding does: at orbital velocity the speeds that matter are a millionth of those in W. So a run is
/// computed in a frame that has W's axes, begins at the base and goes on moving as the base begins to, and what it
/// finds is told in W.

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

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
