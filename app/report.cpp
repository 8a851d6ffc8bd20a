#include <fmt/format.h>

#include "commands.hpp"
#include "report_file.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// "out/x/" is out/x.
fs::path trimmed(const fs::path& folder) { return folder.has_filename() ? folder : folder.parent_path(); }

fs::path default_file(const ReportOptions& options) {
  if (options.second.empty()) return options.folder / "report.html";
  const fs::path other = trimmed(fs::absolute(options.second).lexically_normal());
  return options.folder / fmt::format("report-vs-{}.html", other.filename().string());
}

}  // namespace

int report(const ReportOptions& options) {
  if (const std::string why = why_no_reports(); !why.empty()) {
    to_stderr("grapnel: error: no report: {}\n", why);
    return kSimulationFailed;
  }
  const fs::path folder = trimmed(options.folder),
                 file = options.output.empty() ? default_file(options) : options.output;
  ReportData data;
  try {
    data = options.second.empty() ? report_data(folder, GRAPNEL_VERSION)
                                  : comparison_data(folder, trimmed(options.second), GRAPNEL_VERSION);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error.what());
    return kBadInput;
  }
  try {
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    write_report_file(data, file);
  } catch (const std::exception& error) {
    to_stderr("grapnel: error: {}\n", error.what());
    return kSimulationFailed;
  }
  to_stdout("{}\n", file.string());
  return kDone;
}

}  // namespace grapnel::app
