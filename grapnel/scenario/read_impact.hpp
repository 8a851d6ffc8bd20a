#pragma once

/// @file
/// What happens when grasps close, and how they are to arrive.

#include "grapnel/scenario/reading.hpp"

namespace grapnel {

/// Fills Reading::problem's impact; grasps have been read.
void read_impact(const Node& node, Reading& reading);

/// Relative velocities of grasps, against what says how the joints arrive; the approach has been read.
void check_arrival(Reading& reading);

}  // namespace grapnel
