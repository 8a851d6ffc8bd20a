#pragma once

/// @file
/// Gains of sampled laws that are too large for the clock.

#include <string>
#include <vector>

#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// Which gains of the approach, or of the motion after the impact, make a sampled loop unstable about the present
/// configuration, by how much, and what would do; empty: none, or nothing is sampled. The loops are those of pd and
/// computed torque of the joints and of the base's attitude control, without friction, springs and limits of efforts.
std::vector<std::string> unstable_gains(const CaptureRun& run, bool approach);

}  // namespace grapnel
