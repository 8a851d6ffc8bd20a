#pragma once

/// @file
/// Simulates captures: simulate_capture(), simulate_impact_only(). Public, kept stable.

#include <stop_token>

#include "grapnel/api/problem.hpp"
#include "grapnel/api/result.hpp"
#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {

/// The progress callback of a run that another thread may stop: after a request the result has status `failed`, the
/// failure "stopped", and all earlier results. Calls `progress`, if given, otherwise.
CaptureProgress until_stopped(std::stop_token stop, CaptureProgress progress = {});

}  // namespace grapnel
