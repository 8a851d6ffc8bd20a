#pragma once

/// @file
/// Where results go.

#include <filesystem>
#include <optional>
#include <string>

namespace grapnel::app {

/// The folder for a file's results, made: `asked`, or out/ and the file's name. Empty where nothing can be written,
/// which is said on stderr.
std::optional<std::filesystem::path> results_folder(const std::filesystem::path& asked,
                                                    const std::filesystem::path& file);

/// Whether a scenario can be written as `file` without loss: nothing is there, or something that says in its first
/// line that Grapnel made it. If not, that is said on stderr.
bool may_replace(const std::filesystem::path& file);

}  // namespace grapnel::app
