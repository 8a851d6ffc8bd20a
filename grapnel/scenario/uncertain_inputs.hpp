#pragma once

/// @file
/// What tables call the numbers of an uncertain value.

#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/read_uncertain.hpp"

namespace grapnel {

/// One per number that DrawnValue::shown has. `form`: what stands at the places, or would if it were there; `scenario`
/// has the schema's defaults, and `problem` was read from it.
std::vector<CampaignInput> inputs_of(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
                                     const CaptureProblem& problem);

}  // namespace grapnel
