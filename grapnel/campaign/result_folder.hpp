#pragma once

/// @file
/// Result folders, and the report in them.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/campaign/listener.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/report/report_data.hpp"

namespace grapnel {

/// The sets of files that commands write into a result folder.
enum class Outputs {
  run,
  case_run,  // one case of a study or a campaign, with its scenario.yaml
  sweep,
  campaign,  // also of a map and a merge
  optimization,
  sensitivities,
  images  // files that write_figure() names; checked individually
};

/// Makes the result folder: `requested`, or out/ and the file's name. Returns an empty value, with an error for the
/// listener, if it is not writable, or if a file of the command would replace one of its inputs or something that is
/// not a regular file. Call after all inputs have been read and before any work.
std::optional<std::filesystem::path> results_folder(const std::filesystem::path& requested,
                                                    const std::filesystem::path& file, Outputs outputs,
                                                    Listener& listener);

/// Whether files may be written at these paths: none of them is an input of this command, a pipe or a device. Otherwise
/// the listener gets an error.
bool may_write(const std::vector<std::filesystem::path>& files, Listener& listener);

/// Records the files of a result folder as inputs of this command.
void note_results(const std::filesystem::path& folder);

/// Whether the folder may hold the results of a scenario with this name and digest: it holds no results of another
/// scenario, a sweep, a campaign or an optimization. Otherwise the listener gets an error.
bool holds_no_others(const std::filesystem::path& folder, const std::string& name, const std::string& sha256,
                     Listener& listener);

/// Whether a scenario may be written as `file` without loss: the file does not exist, or its first line states that
/// Grapnel made it. Otherwise the listener gets an error.
bool may_replace(const std::filesystem::path& file, Listener& listener);

/// Why this program cannot write reports, and the remedy; empty if it can.
std::string why_no_reports();

/// The outcome of writing the report.
struct FolderReport {
  std::string line;     // for the list of outputs, with a newline; empty: none
  bool failed = false;  // it could not be written; the listener has the error
};

/// Writes FOLDER/report.html from the results in the folder. Removes an earlier report with `no_report` or if reports
/// are not available, so that a report always belongs to the results beside it. The listener gets a warning if the
/// results are too large for a page. Never throws: the caller has results left to tell.
FolderReport write_folder_report(const std::filesystem::path& folder, ResultKind kind, bool no_report,
                                 Listener& listener);

/// Writes the report of a result folder, or with a second folder the comparison of two runs. `file`: empty is
/// report.html or report-vs-SECOND.html in the folder.
Ending write_report_of(const std::filesystem::path& folder, const std::filesystem::path& second,
                       std::filesystem::path file, Listener& listener);

/// Writes the page over all results in a folder and below it. `file`: empty is index.html in the folder.
Ending write_index_of(const std::filesystem::path& folder, std::filesystem::path file, Listener& listener);

/// Draws a figure of a result folder. `image`: empty is figures/WHAT.pdf in the folder.
Ending draw_figure(const FigureRequest& request, std::filesystem::path image, Listener& listener);

}  // namespace grapnel
