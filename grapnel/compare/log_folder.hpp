#pragma once

/// @file
/// Results of a comparison with a log, and of impulses from a log, in a folder.

#include <filesystem>
#include <stop_token>

#include "grapnel/campaign/listener.hpp"
#include "grapnel/compare/measured_impulses.hpp"

namespace grapnel {

/// A run's result folder, a log of its experiment, and the mapping between them.
struct RunAndLog {
  std::filesystem::path run, log, mapping;
};

struct LogFolderOptions {
  std::filesystem::path folder;  ///< of the results; empty: compare-LOG or impulses-LOG in the run's folder
  bool quiet = false;            ///< no notes
  bool no_report = false;        ///< no page
  std::stop_token stop = {};     ///< a request before the results are written leaves the folder as it was
};

/// The folder of the results, with `command` for an empty one.
std::filesystem::path log_results_folder(const RunAndLog& input, const std::filesystem::path& folder,
                                         const char* command);

/// Compares, and writes comparison.json, comparison.csv and comparison.html. Failed: a quantity disagrees, or a file
/// could not be written. @throws InputError with all errors of run, log and mapping
Ending run_comparison_folder(const RunAndLog& input, const LogFolderOptions& options, Listener& listener);

/// Estimates impulses and momentum, and writes impulses.json, impulses.csv, momentum.csv and impulses.html. Failed: the
/// balance of a contact is violated, or a file could not be written. @throws InputError
Ending run_impulses_folder(const RunAndLog& input, const ImpulseOptions& settings, const LogFolderOptions& options,
                           Listener& listener);

}  // namespace grapnel
