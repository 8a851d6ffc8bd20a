#pragma once

/// @file
/// Converts the external loads of a model and a phase's setup to the tables and numbers of lane_phase_tables.hpp. Part
/// of lane_phase_setup.hpp, which documents the exceptions.

#include <span>

#include "grapnel/lanes/lane_phase.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Writes LaneStructure::outside and loads; their parts of an interval's block follow the existing ones. @throws
/// std::invalid_argument if a load is invalid, acts on no body, or is in the axes of an orbit that does not exist.
void describe_outside(LaneStructure& structure, const Model& model, const PhaseSetup& setup);

/// Why a setup does not have this structure; empty if it does.
std::string outside_difference(const LaneStructure& structure, const Model& model, const PhaseSetup& setup);

/// Writes the loads' parts of an interval's block, without its end time, for the interval that contains the time
/// `inside`. The setup has this structure, and the block is initially zero.
void write_loads(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, double inside,
                 double* block);

/// Writes the thrusters' wrench from `begin` to `end` >= begin, an interval without valve edges, in the format of a
/// command (ControlTable).
void write_thrust(const Model& model, const BaseActuation& base, double begin, double end, double* line);

/// LaneCase::outside of a setup with this structure.
std::vector<double> outside_numbers(const LaneStructure& structure, const Model& model, const PhaseSetup& setup);

}  // namespace grapnel::lanes
