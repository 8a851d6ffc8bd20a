#pragma once

/// @file
/// Tables of the loads of all phases against ratings.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The load with the smallest margin over all phases; null without ratings. `without_assumed`: only loads that do not
/// depend on an assumed duration.
const PeakLoad* worst_margin(const CaptureResult& result, bool without_assumed = false);

/// The assumed duration over which a load is a mean [s]; 0 if none is assumed.
double assumed_duration(const CaptureResult& result, const PeakLoad& peak);

/// Whether a margin of an impact depends on its assumed duration.
bool rests_on_duration(const ImpactReport& impact, const LoadMargin& margin);

/// "worst margin: ...", for the head of a result; empty without ratings.
std::string worst_margin_line(const CaptureResult& result);
/// The worst load of each rated joint and gripper over all phases, in ascending order of margin; and the drives at
/// their limits, with time and duration.
std::string margins_table(const CaptureResult& result);

}  // namespace grapnel
