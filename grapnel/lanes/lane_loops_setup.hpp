#pragma once

/// @file
/// Loop closures of a phase in the format of the lanes: the structure shared by all cases, and the numbers of one case.

#include <string>
#include <vector>

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Why lanes cannot integrate the closed loops of a phase; empty if they can or there are none.
std::string loop_obstacle(const Model& model, const PhaseSetup& setup);

/// Closure rows of each loop. If all revolute joints of a loop have parallel axes, its closure has rows only for the
/// directions in which its joints can move: three instead of six for a rigid grasp (docs/theory, section 8.3).
std::vector<LoopTable> loop_tables(const Model& model, const PhaseSetup& setup);

/// kLoopNumbers of each closure.
std::vector<double> loop_numbers(const Model& model, const PhaseSetup& setup);

}  // namespace grapnel::lanes
