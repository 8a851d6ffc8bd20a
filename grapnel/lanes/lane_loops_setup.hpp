#pragma once

/// @file
/// Loop closures of a phase as lanes take them: the part of the structure that cases share, and one case's numbers.

#include <string>
#include <vector>

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Why lanes cannot keep a phase's loops closed; empty if they can, or there are none.
std::string loop_obstacle(const Model& model, const PhaseSetup& setup);

/// Where all joints of a loop that turn do so about parallel axes, its closure has rows for what they can move alone,
/// of a rigid grasp three instead of six (docs/theory, section 8.3).
std::vector<LoopTable> loop_tables(const Model& model, const PhaseSetup& setup);

/// kLoopNumbers of each closure.
std::vector<double> loop_numbers(const Model& model, const PhaseSetup& setup);

}  // namespace grapnel::lanes
