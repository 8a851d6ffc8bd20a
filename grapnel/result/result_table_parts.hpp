#pragma once

/// @file
/// Parts of result_table(), each with its leading empty line, and empty where it does not apply.

#include <algorithm>
#include <string>
#include <vector>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Every component is unique.
inline bool all_of(const std::vector<bool>& determined) {
  return std::all_of(determined.begin(), determined.end(), [](bool unique) { return unique; });
}

/// Marks what follows the first overlap.
std::string beyond_overlap(const CaptureResult& result, double time);

/// Every impact: grasps, rebound, force histories, drives, gaps, margins, energies.
std::string impact_tables(const CaptureResult& result);

/// Wheels, gyros, thrusters, actuators that saturated, and joints with friction, stops or motors.
std::string actuator_tables(const CaptureResult& result);

/// Contacts between shapes; the stages of captures by contacts.
std::string contact_table(const CaptureResult& result);
std::string stage_table(const CaptureResult& result);

/// Control laws that move all joints together: how they ended, and what they reached.
std::string law_tables(const CaptureResult& result);

}  // namespace grapnel
