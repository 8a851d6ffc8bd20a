#pragma once

/// @file
/// What acts from outside, from a model and a phase's setup to the tables and numbers of lane_phase_tables.hpp. Parts
/// of lane_phase_setup.hpp, which says when they throw.

#include <span>

#include "grapnel/lanes/lane_phase.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel::lanes {

/// Writes LaneStructure::outside and loads, whose parts of an interval's block follow what is there.
/// @throws std::invalid_argument if a load is invalid, on no body, or in the axes of an orbit that is not there.
void describe_outside(LaneStructure& structure, const Model& model, const PhaseSetup& setup);

/// Why a setup is not of that structure; empty: it is.
std::string outside_difference(const LaneStructure& structure, const Model& model, const PhaseSetup& setup);

/// Writes the loads' parts of an interval's block, without its end time, for the interval that holds the time `inside`.
/// The setup is of that structure, and the block is zero before.
void write_loads(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, double inside,
                 double* block);

/// Writes the thrusters' wrench from `begin` to `end` >= begin, between which no valve has an edge, as a command has it
/// (ControlTable).
void write_thrust(const Model& model, const BaseActuation& base, double begin, double end, double* line);

/// LaneCase::outside of a setup of that structure.
std::vector<double> outside_numbers(const LaneStructure& structure, const Model& model, const PhaseSetup& setup);

}  // namespace grapnel::lanes
