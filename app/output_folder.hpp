#pragma once

/// @file
/// Where results go.

#include <filesystem>
#include <string>

namespace grapnel::app {

/// Makes the folder. Why nothing can be written there, before a long simulation finds out; empty if it can.
std::string cannot_write_to(const std::filesystem::path& folder);

}  // namespace grapnel::app
