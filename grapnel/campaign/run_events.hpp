#pragma once

/// @file
/// The discrete properties of a run: its sequence of events. Between two runs with different ones, outcomes need not
/// change smoothly.

#include <string>
#include <utility>
#include <vector>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Properties by name: {"impacts", "2"}, {"grasp tip-1", "closed"}.
std::vector<std::pair<std::string, std::string>> run_events(const CaptureResult& result);

}  // namespace grapnel
