#pragma once

/// @file
/// Warnings of efforts beyond any real robot joint, for joints without an effort limit.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// One warning per joint without an effort limit whose effort in a phase of motion exceeded 10 kN m or 100 kN, ten
/// times the efforts of the largest space robots: with joint, effort, time and phase. Reads CaptureResult::peak_loads.
std::vector<std::string> implausible_efforts(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
