#pragma once

/// @file
/// Scenario, robot and target files (load_scenario(), load_robot(), load_ready_made_target()), and scenarios with
/// changed values as new files. Public, kept stable.

#include "grapnel/api/error.hpp"
#include "grapnel/api/problem.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {

/// Writes a scenario with changed values as a file: reading it gives the same problem as load_scenario(scenario,
/// overrides). The paths of other files become relative to the new file. Replaces `file` atomically. @throws
/// InputError with all errors; std::runtime_error if the file cannot be written.
void save_scenario(const std::filesystem::path& scenario, std::span<const Override> overrides,
                   const std::filesystem::path& file);

}  // namespace grapnel
