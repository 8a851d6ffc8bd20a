#pragma once

/// @file
/// Efforts that no robot's joint gives, of joints whose limit is not stated.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// A warning per joint without an effort limit that gave more in a phase of motion than 10 kN m or 100 kN, ten times
/// what the largest space robots' joints give: with joint, effort, time and phase. Reads CaptureResult::peak_loads.
std::vector<std::string> implausible_efforts(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
