#pragma once

/// @file
/// Loads of all phases against ratings, as people read them.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The load with the least margin over all phases; null where nothing is rated. `without_assumed`: of those alone whose
/// size does not rest on an assumed duration.
const PeakLoad* worst_margin(const CaptureResult& result, bool without_assumed = false);

/// The load of which a peak is the mean over an assumed time: how long that is [s]; 0 where none is assumed.
double assumed_duration(const CaptureResult& result, const PeakLoad& peak);

/// Whether a margin of an impact rests on the duration that it is assumed to have.
bool rests_on_duration(const ImpactReport& impact, const LoadMargin& margin);

/// "worst margin: ...", for the head of a result; empty where nothing is rated.
std::string worst_margin_line(const CaptureResult& result);
/// The worst load of everything that is rated, over all phases, least margin first; and which drives ran at their
/// limits, when and how long.
std::string margins_table(const CaptureResult& result);

}  // namespace grapnel
