#pragma once

/// @file
/// Whether a result's numbers are numbers.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The first distance, speed, impulse, energy or scale of a result that is infinite or not a number, in words; empty if
/// all are finite. (Vectors count by their length, which overflows where their squares do.) Checks in such numbers
/// check nothing: a deviation over an infinite scale is zero.
std::string first_not_finite(const CaptureResult& result);

}  // namespace grapnel
