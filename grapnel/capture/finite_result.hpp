#pragma once

/// @file
/// Checks that a result's numbers are finite.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The first infinite or NaN number of a result's states, grasps, impacts and scales, as its place in summary.json:
/// "impact.grasps[left].impulse"; empty if all are finite. Vectors are checked by their length, which overflows when
/// their squares do; values that may be unknown (null in summary.json) are skipped. Conservation checks on such numbers
/// are meaningless: a deviation over an infinite scale is zero.
std::string first_not_finite(const CaptureResult& result);

}  // namespace grapnel
