#pragma once

/// @file
/// The lane stepper's translation units, one per instruction set.

#include "grapnel/lanes/lane_phase_tables.hpp"

namespace grapnel::lanes {

/// Integrates all cases of an exchange; each defined where it is compiled for its set.
void run_lane_phase_one_lane(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_sse2(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_avx2(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_avx512(const PhaseTables& tables, CaseExchange& exchange);

}  // namespace grapnel::lanes
