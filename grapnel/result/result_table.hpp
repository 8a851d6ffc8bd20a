#pragma once

/// @file
/// A capture's results for the terminal.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Plain text of at most 100 columns: verdict and warnings, approach, impact per grasp, ledger. Four to six significant
/// digits; summary.json has them all. Thread safety: pure.
std::string result_table(const CaptureResult& result);

}  // namespace grapnel
