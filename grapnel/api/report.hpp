#pragma once

/// @file
/// report.html of a result folder. Public, kept stable.

#include <filesystem>

namespace grapnel {

/// Whether this library can write reports: its build had Node.js.
bool has_reports();

/// Writes report.html into a folder with the results of a run, sweep, campaign or optimization. @throws
/// std::runtime_error if the folder has no results or the report cannot be written.
void save_report(const std::filesystem::path& folder);

}  // namespace grapnel
