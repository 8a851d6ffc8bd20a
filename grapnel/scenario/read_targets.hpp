#pragma once

/// @file
/// Targets and who grips what, from a scenario's tree.

#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// Writes problem.targets, targets, points.
void read_targets(Reading& reading);

/// Writes problem.grasps, gripped. Reads what read_targets() writes.
void read_grasps(Reading& reading);

}  // namespace grapnel
