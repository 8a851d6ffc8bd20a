#pragma once

/// @file
/// Whether a result's numbers are numbers.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The first number of a result's states, grasps, impacts and scales that is infinite or none, as its place in
/// summary.json: "impact.grasps[left].impulse"; empty if all are finite. Vectors count by their length, which overflows
/// where their squares do; what may be unknown (null in summary.json) is not looked at. Checks of conservation on such
/// numbers check nothing: a deviation over an infinite scale is zero.
std::string first_not_finite(const CaptureResult& result);

}  // namespace grapnel
