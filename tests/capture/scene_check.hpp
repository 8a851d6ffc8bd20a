#pragma once

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing {

/// The body of a name that is no target. @throws std::invalid_argument if there is none.
const SceneBody& body_named(const Scene& scene, const std::string& name);

/// Largest distance, over all samples, of the recorded end-effectors from where their links carry them; and of links
/// from where their joints can be.
struct SceneDeviation {
  double end_effectors = 0, joints = 0, out_of_plane = 0;
};
SceneDeviation scene_deviation(const CaptureResult& result);

/// Expects that names lead somewhere, that parents come first, and that every body's motion is recorded.
void expect_complete_scene(const CaptureResult& result, const CaptureProblem& problem);

}  // namespace grapnel::testing
