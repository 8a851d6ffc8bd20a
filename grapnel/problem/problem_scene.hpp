#pragma once

/// @file
/// What a problem's bodies look like, for drawings.

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {

/// Bodies, frames and shapes of a problem; the paths of their motion are Recorder's. Scene::planar: masses, joints,
/// grasps, initial motion, gravity, orbit and loads are their own mirror images in the plane z = 0 of W, to 1e-9 of 1
/// m, 1 m/s and so on; then nothing ever moves but along that plane.
/// @throws CaptureProblemError or ModelError as simulate_capture().
Scene scene_of(const CaptureProblem& problem);

}  // namespace grapnel
