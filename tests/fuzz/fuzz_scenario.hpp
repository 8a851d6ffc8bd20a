#pragma once

/// @file
/// The reader of scenarios against arbitrary bytes. Thread safety: one thread at a time, which uses one folder.

#include <string_view>

namespace grapnel::fuzz {

enum class Outcome {
  refused,    // by the reader, with faults
  no_system,  // accepted, but the bodies yield no model
  built       // accepted, and the system of the capture was built
};

/// Reads the input (its parts are described in fuzz_scenario.cpp) and builds the system that it describes.
/// @throws anything that is neither an expected refusal nor success: a bug.
Outcome try_input(std::string_view bytes);

}  // namespace grapnel::fuzz
