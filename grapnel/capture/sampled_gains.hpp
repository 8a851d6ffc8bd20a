#pragma once

/// @file
/// Detects gains of sampled laws that are too large for the sample time.

#include <string>
#include <vector>

#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

/// Describes the gains of the approach, or of the motion after the impact, that make a sampled loop unstable about the
/// current configuration: by how much, and which gains would be stable; empty: none, or no sampling. The loops are
/// those of pd and computed torque of the joints and of the base's attitude control, without friction, springs and
/// limits of efforts.
std::vector<std::string> unstable_gains(const CaptureRun& run, bool approach);

}  // namespace grapnel
