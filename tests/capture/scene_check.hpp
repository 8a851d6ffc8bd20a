#pragma once

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel::testing {

/// The body with this name that is not a target. @throws std::invalid_argument if there is none.
const SceneBody& body_named(const Scene& scene, const std::string& name);

/// Largest deviations over all samples: recorded end-effectors from the poses that follow from their links, links from
/// the poses that their joints allow, and motion out of the plane.
struct SceneDeviation {
  double end_effectors = 0, joints = 0, out_of_plane = 0;
};
SceneDeviation scene_deviation(const CaptureResult& result);

/// Expects that the scene is complete, that parents precede children, and that every body's motion is recorded.
void expect_complete_scene(const CaptureResult& result, const CaptureProblem& problem);

}  // namespace grapnel::testing
