#pragma once

/// @file
/// When grips close and let go, from a scenario's tree, and what that needs of the phases.

#include <string>

#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// "closes_at" and "closes_on_arrival" of the grasp at `path`. Reads end-effectors; writes closes, closes_at.
void read_closing(const Node& node, const std::string& path, GraspSetup& grasp, Reading& reading);

/// "release" of post_impact. Reads problem.grasps, approach; writes problem.post_impact->releases, in the order of
/// time.
void read_releases(const Node& post_impact, Reading& reading);

}  // namespace grapnel
