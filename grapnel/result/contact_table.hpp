#pragma once

/// @file
/// Tables of the contacts between shapes.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The pairs that touched: times, forces, depth, slip and losses; the number of the others. Empty: no pair may touch.
std::string contact_table(const CaptureResult& result);

/// The stages of captures by contacts, and their times. Empty: none are stated.
std::string stage_table(const CaptureResult& result);

}  // namespace grapnel
