#pragma once

/// @file
/// The shapes of a problem's bodies, for drawings.

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {

/// Bodies, frames and shapes of a problem; Recorder adds the paths of their motion. Scene::planar: masses, joints,
/// grasps, initial motion, gravity, orbit and loads are symmetric with respect to the plane z = 0 of W, to 1e-9 of 1 m,
/// 1 m/s and so on; then all motion is parallel to that plane. @throws CaptureProblemError or ModelError as
/// simulate_capture().
Scene scene_of(const CaptureProblem& problem);

}  // namespace grapnel
