#pragma once

/// @file
/// Cases of a campaign as complete runs.

#include <cstdint>
#include <filesystem>

#include "grapnel/campaign/campaign.hpp"
#include "run_problem.hpp"

namespace grapnel::app {

/// Writes case k of `campaign` as a complete scenario, FOLDER/scenario.yaml, and runs it. Returns the exit code.
int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches);

}  // namespace grapnel::app
