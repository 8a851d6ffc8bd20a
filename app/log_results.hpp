#pragma once

/// @file
/// Results of commands that relate a log of measurements to a run.

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/report/report_data.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel::app {

struct LogResults {
  std::filesystem::path run, log, folder;
  std::string scenario;
  std::vector<std::pair<std::string, std::string>> files = {};  // names and contents, in the order of writing
  std::string page = {};                                        // its name
  std::function<ReportData()> page_data = {};
  std::string text = {};  // for the terminal
  Verdict verdict = Verdict::not_checked;
};

/// `output`, or where it is empty `command`-LOG in the run's folder, without the extension of the log.
std::filesystem::path log_results_folder(const std::filesystem::path& output, const std::filesystem::path& run,
                                         const std::filesystem::path& log, const std::string& command);

/// Writes files and page, and prints the text. Returns the exit code: 1 for the verdict no.
int write_log_results(const LogResults& results, bool quiet);

}  // namespace grapnel::app
