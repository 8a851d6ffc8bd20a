#pragma once

/// @file
/// Runs an identification and writes its result folder.

#include <filesystem>
#include <vector>

#include "grapnel/campaign/listener.hpp"
#include "grapnel/compare/identification.hpp"

namespace grapnel {

/// The files of the folder.
std::vector<std::filesystem::path> identification_files(const Identification& identification,
                                                        const std::filesystem::path& folder);

/// Fits, and writes identification.json, fitted.yaml, evaluations.csv, and the comparison of each log with the fitted
/// run in logs/NAME. A stopped identification leaves evaluations.csv and the best values so far in fitted.yaml. Failed:
/// the model disagrees with the logs, or a file could not be written.
Ending run_identification_folder(const Identification& identification, const std::filesystem::path& folder,
                                 const FolderOptions& options, Listener& listener);

}  // namespace grapnel
