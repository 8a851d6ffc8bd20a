#pragma once

/// @file
/// Result folders, and the report in them.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/report/report_data.hpp"

namespace grapnel::app {

/// The sets of files that commands write into a result folder.
enum class Outputs {
  run,
  case_run,  // one case of a study or a campaign, with its scenario.yaml
  sweep,
  campaign,  // also of a map and a merge
  optimization,
  images  // files that write_figure() names; checked individually
};

/// Makes the result folder: `asked`, or out/ and the file's name. Returns an empty value, with an error on stderr, if
/// it is not writable, or if a file of the command would replace one of its inputs or something that is not a regular
/// file. Call after all inputs have been read and before any work.
std::optional<std::filesystem::path> results_folder(const std::filesystem::path& asked,
                                                    const std::filesystem::path& file, Outputs outputs);

/// Whether files may be written at these paths: none of them is an input of this command, a pipe or a device. Otherwise
/// prints an error on stderr.
bool may_write(const std::vector<std::filesystem::path>& files);

/// Records the files of a result folder as inputs of this command.
void note_results(const std::filesystem::path& folder);

/// Whether the folder may hold the results of a scenario with this name and digest: it holds no results of another
/// scenario, a sweep, a campaign or an optimization. Otherwise prints an error on stderr.
bool holds_no_others(const std::filesystem::path& folder, const std::string& name, const std::string& sha256);

/// Whether a scenario may be written as `file` without loss: the file does not exist, or its first line states that
/// Grapnel made it. Otherwise prints an error on stderr.
bool may_replace(const std::filesystem::path& file);

/// Why this program cannot write reports, and the remedy; empty if it can.
std::string why_no_reports();

/// The outcome of writing the report.
struct FolderReport {
  std::string line;     // for the list of outputs, with a newline; empty: none
  bool failed = false;  // it could not be written; the error is on stderr
};

/// Writes FOLDER/report.html from the results in the folder. Removes an earlier report with `no_report` or if reports
/// are not available, so that a report always belongs to the results beside it. Prints a warning on stderr if the
/// results are too large for a page. Never throws: the caller has results left to print.
FolderReport write_folder_report(const std::filesystem::path& folder, ResultKind kind, bool no_report);

/// Writes a report, and prints a warning on stderr if it is large. @throws std::runtime_error if it cannot be written.
void write_report_file(const ReportData& data, const std::filesystem::path& file);

}  // namespace grapnel::app
