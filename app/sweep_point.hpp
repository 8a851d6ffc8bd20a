#pragma once

/// @file
/// One point of a study, to be looked at.

#include <cstddef>

#include "commands.hpp"
#include "grapnel/study/study.hpp"

namespace grapnel::app {

/// Writes point `point` of `points` as a complete scenario, DIR/scenario.yaml, and runs that as `grapnel run` does.
/// Returns the exit code.
int sweep_point(const Study& study, std::size_t point, std::size_t points, const SweepOptions& options);

}  // namespace grapnel::app
