#pragma once

/// @file
/// One point of a sweep, or one case of a campaign, as a complete run.

#include <cstdint>
#include <filesystem>

#include "grapnel/campaign/campaign.hpp"
#include "run_problem.hpp"

namespace grapnel::app {

/// Writes case k as a complete scenario, FOLDER/scenario.yaml, and runs that as `grapnel run` does: what was written is
/// what is simulated. Returns the exit code.
int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches);

/// The same for --only: that there is such a case, and into which folder it goes; `asked`: by the user, if not empty.
int only_case(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& asked,
              const RunSwitches& switches);

}  // namespace grapnel::app
