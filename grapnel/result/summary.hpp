#pragma once

/// @file
/// summary.json: one capture's results as text. What it holds is described in result_fields.hpp and published by
/// result_contract.hpp.

#include <string>
#include <string_view>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Pretty JSON with keys in a fixed order and a newline at the end. Numbers read back to the same double; NaN and
/// infinities, which JSON lacks, become null. Phases that did not happen are absent. `version`: of Grapnel.
std::string summary_json(const CaptureResult& result, std::string_view version);

}  // namespace grapnel
