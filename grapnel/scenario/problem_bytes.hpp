#pragma once

/// @file
/// All of a problem as bytes, for exact comparison.

#include <string>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// The bits of every member but the sha256 and the source: two problems are the same, to the last bit and with the
/// signs of zeros, if and only if their bytes are. Not a format: only for comparison within one program. Meshes count
/// as the same where they are one object.
std::string problem_bytes(const CaptureProblem& problem);

}  // namespace grapnel
