#pragma once

/// @file
/// One case of a study or campaign, to be looked at.

#include <filesystem>
#include <functional>
#include <string>

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

}  // namespace grapnel::app
