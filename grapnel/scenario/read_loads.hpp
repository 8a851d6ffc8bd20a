#pragma once

/// @file
/// External wrenches and what is watched of clearances, from a scenario's tree.

#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// Writes problem.loads. Reads the names of robot and targets.
void read_external_wrenches(Reading& reading);

/// Writes problem.clearance. Reads the names of robot and targets.
void read_clearance(Reading& reading);

}  // namespace grapnel
