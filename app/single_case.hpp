#pragma once

/// @file
/// One point of a sweep, or one case of a campaign, as a complete run.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "commands.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/study/study.hpp"
#include "run_problem.hpp"

namespace grapnel::app {

struct SingleCase {
  std::string what;             // "point 12", "case 12"
  std::string of;               // "study", "campaign"
  std::filesystem::path study;  // its file
  /// The complete scenario, for a place on disk. @throws as it may
  std::function<std::string(const std::filesystem::path& place)> text;
};

/// Writes the case as a complete scenario, FOLDER/scenario.yaml, and runs that as `grapnel run` does: what was written
/// is what is simulated. Returns the exit code.
int run_single_case(const SingleCase& single, const std::filesystem::path& folder, const RunSwitches& switches);

/// Writes point `point` of `points` as a complete scenario, DIR/scenario.yaml, and runs that as `grapnel run` does.
/// Returns the exit code.
int sweep_point(const Study& study, std::size_t point, std::size_t points, const SweepOptions& options);

/// Writes case k of `campaign` as a complete scenario, FOLDER/scenario.yaml, and runs it. Returns the exit code.
int run_case_completely(const Campaign& campaign, std::uint64_t k, const std::filesystem::path& folder,
                        const RunSwitches& switches);

}  // namespace grapnel::app
