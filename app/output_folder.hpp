#pragma once

/// @file
/// Where results go, and the report beside them.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/report/report_data.hpp"

namespace grapnel::app {

/// What a command writes into its result folder.
enum class Outputs {
  run,
  case_run,  // of a study or a campaign, with its scenario.yaml
  sweep,
  campaign,  // of a map and a merge too
  optimization,
  images  // files that write_figure() names; checked one by one
};

/// The folder for a file's results, made: `asked`, or out/ and the file's name. Empty, with an error on stderr, where
/// nothing can be written or where a file that the command writes there would replace one of its inputs or something
/// that is no file. Called once all inputs have been read and before any work.
std::optional<std::filesystem::path> results_folder(const std::filesystem::path& asked,
                                                    const std::filesystem::path& file, Outputs outputs);

/// Whether files may be written at these places: none of them is an input of this command, a pipe or a device. If not,
/// that is an error on stderr.
bool may_write(const std::vector<std::filesystem::path>& files);

/// Remembers the files of a result folder that a command reads as inputs.
void note_results(const std::filesystem::path& folder);

/// Whether the folder may take results of a scenario with this name and digest: it holds no results of another
/// scenario, of a sweep, a campaign or an optimization. If not, that is an error on stderr.
bool holds_no_others(const std::filesystem::path& folder, const std::string& name, const std::string& sha256);

/// Whether a scenario can be written as `file` without loss: nothing is there, or something that says in its first
/// line that Grapnel made it. If not, that is said on stderr.
bool may_replace(const std::filesystem::path& file);

/// Why there are no reports in this program, and what helps; empty if there are.
std::string why_no_reports();

/// What became of the report beside results.
struct FolderReport {
  std::string line;     // for the list of outputs, with its end; empty: nothing to say
  bool failed = false;  // it could not be written, which was said on stderr
};

/// Writes FOLDER/report.html from results that have just been written there, or removes an earlier one with
/// `no_report` or where there can be none: what is there never belongs to other results. Results too large for a page
/// are a warning on stderr. Throws nothing: what the results are is still to be said.
FolderReport write_folder_report(const std::filesystem::path& folder, ResultKind kind, bool no_report);

/// Writes a report, and warns on stderr where it is large. @throws std::runtime_error if it cannot be written.
void write_report_file(const ReportData& data, const std::filesystem::path& file);

}  // namespace grapnel::app
