#pragma once

/// @file
/// Which phase of a run took many steps, what in the scenario may be the cause, and which setting changes it. Counts
/// steps, not seconds: the same on every machine.

#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Steps per second of motion beyond which something other than the motion itself makes them short: runs of the shipped
/// scenarios take 1 to 60 without, and up to 330 with noise, friction or stiff controllers.
inline constexpr double kManySteps = 1000;  // [1/s]
/// Fewer steps than these are done in about a second whatever they are of.
inline constexpr long kFewSteps = 20'000;

/// A line per phase (approach, what follows the impact) that takes more than both; empty for most runs.
std::vector<std::string> slow_phases(const CaptureProblem& problem, const CaptureResult& result);

}  // namespace grapnel
