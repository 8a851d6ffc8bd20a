#pragma once

/// @file
/// Parts of result_table(), each with its leading empty line, and empty where it does not apply.

#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// The components, in the printed precision. Those at the level of rounding error relative to the others are printed as
/// zero; summary.json has all digits.
std::string short_vector(const Vector3d& v);

/// Three digits, for residuals.
std::string small_number(double value);

/// Marks what follows the first overlap.
std::string beyond_overlap(const CaptureResult& result, double time);

/// Every impact: grasps, rebound, force histories, drives, gaps, margins, energies.
std::string impact_tables(const CaptureResult& result);

/// Wheels, gyros, thrusters, actuators that saturated, and joints with friction, stops or motors.
std::string actuator_tables(const CaptureResult& result);

/// Laws that prescribe the motion of a body: how they ended, and what they reached.
std::string law_tables(const CaptureResult& result);

}  // namespace grapnel
