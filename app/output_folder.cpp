#include "output_folder.hpp"

#include <fmt/format.h>

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

#include "grapnel/report/report_html.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace fs = std::filesystem;

namespace {

// Makes the folder. Why nothing can be written there, before a long simulation finds out; empty if it can.
std::string cannot_write_to(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return error.message();
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::string() : std::strerror(errno);
}

}  // namespace

std::optional<std::filesystem::path> results_folder(const std::filesystem::path& asked,
                                                    const std::filesystem::path& file) {
  std::filesystem::path folder = asked.empty() ? std::filesystem::path("out") / file.stem() : asked;
  const std::string why = cannot_write_to(folder);
  if (why.empty()) return folder;
  to_stderr("grapnel: error: cannot write results to '{}': {}\n", folder.string(), why);
  return std::nullopt;
}

bool may_replace(const std::filesystem::path& file) {
  constexpr std::string_view kMade = "# Made by grapnel";
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return true;
  std::string first;
  if (std::filesystem::is_regular_file(file, error)) {
    std::ifstream stream(file, std::ios::binary);
    std::getline(stream, first);
  }
  if (first.starts_with(kMade)) return true;
  to_stderr("{}: error: is there already, and grapnel did not make it; choose another folder with -o\n", file.string());
  return false;
}

std::string why_no_reports() {
  if (!embedded_viewer().empty()) return {};
  return "this grapnel was built without Node.js; with Node.js 18 or later and npm, configure with -DGRAPNEL_WEB=ON "
         "and build again";
}

void write_report_file(const ReportData& data, const fs::path& file) {
  const std::size_t bytes = write_report(data, file);
  if (bytes <= kLargeReport) return;
  to_stderr("{}: warning: the report has {:.0f} MB and will open slowly\n", file.string(),
            static_cast<double>(bytes) / 1e6);
}

FolderReport write_folder_report(const fs::path& folder, ResultKind kind, bool no_report) {
  const fs::path file = folder / "report.html";
  std::error_code ignored;
  try {
    const std::string why_none = why_no_reports();
    if (no_report || !why_none.empty()) {
      fs::remove(file);  // of earlier results
      return {no_report ? "" : fmt::format("no report: {}\n", why_none)};
    }
    write_report_file(report_data(folder, GRAPNEL_VERSION, kind), file);
    return {fmt::format("report: {}\n", file.string())};
  } catch (const TooLarge& error) {
    fs::remove(file, ignored);
    to_stderr("grapnel: warning: no report: {}\n", error.what());
    return {};
  } catch (const std::exception& error) {
    fs::remove(file, ignored);
    to_stderr("grapnel: error: no report: {}\n", error.what());
    return {"", true};
  }
}

}  // namespace grapnel::app
