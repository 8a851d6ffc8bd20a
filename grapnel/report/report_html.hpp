#pragma once

/// @file
/// A report: one HTML file with the data and the viewer, without network requests. The same results give the same
/// bytes.

#include <filesystem>
#include <string>
#include <string_view>

#include "grapnel/report/report_data.hpp"

namespace grapnel {

// The page's program and style (web/), bundled and embedded at build time.

struct Viewer {
  std::string_view script, style;
  bool empty() const { return script.empty(); }
};

/// Empty in programs that were built without Node.js.
Viewer embedded_viewer();

/// Size above which reports are slow to open; programs that write them give a warning.
inline constexpr std::size_t kLargeReport = 20'000'000;  // [bytes]

/// What a page may request: nothing, or the server it comes from (a live page).
enum class PageRequests { none, own_server };

/// The page. Names and texts in the data are never interpreted as markup.
std::string report_html(const ReportData& data, const Viewer& viewer, PageRequests requests = PageRequests::none);

/// Writes the page with the embedded viewer, in one step (write_file_atomically). Returns its size in bytes. @throws
/// std::runtime_error naming the path and the reason; also if the viewer is not embedded.
std::size_t write_report(const ReportData& data, const std::filesystem::path& path);

}  // namespace grapnel
