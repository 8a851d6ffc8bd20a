#pragma once

/// @file
/// A capture's results for the terminal.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Plain text of at most 100 columns: verdict and warnings, approach, impacts per grasp, releases, how loops were kept
/// closed, loads on the grasps, ledger. Three to six significant digits; summary.json has them all.
std::string result_table(const CaptureResult& result);

}  // namespace grapnel
