#pragma once

/// @file
/// Who waits for a capture to be worked out. Thread safety: plain values.

#include <functional>
#include <string>

namespace grapnel {

/// Told after every step where a run is: the phase, the simulated time reached and the phase's end. While the approach
/// is planned the phase is kPlanning, and the two numbers are the evaluations so far and the most there may be
/// (PlanSetup::max_evaluations). What it throws ends the run, unless it is a std::runtime_error, which becomes the
/// result's failure.
using CaptureProgress = std::function<void(const std::string& phase, double time, double end)>;

inline constexpr const char* kPlanning = "planning";

}  // namespace grapnel
