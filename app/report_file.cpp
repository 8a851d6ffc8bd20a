#include "report_file.hpp"
#include "terminal.hpp"

#include <fmt/format.h>

#include "grapnel/report/report_html.hpp"

namespace grapnel::app {

namespace fs = std::filesystem;

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
