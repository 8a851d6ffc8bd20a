#include "grapnel/report/report_html.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "grapnel/report/base64.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/text/message_text.hpp"

#ifdef GRAPNEL_HAS_VIEWER
// In viewer.S, which CMake makes.
extern "C" const char grapnel_viewer_script[], grapnel_viewer_script_end[];
extern "C" const char grapnel_viewer_style[], grapnel_viewer_style_end[];
#endif
namespace grapnel {
namespace {

// The digest of an element's text as a policy names it.
std::string policy_hash(std::string_view text) {
  const std::string hex = sha256(text);
  std::vector<std::uint8_t> digest;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    digest.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return "'sha256-" + base64_of(std::span<const std::uint8_t>(digest)) + "'";
}

// Nothing is fetched, and no script runs but the viewer: whatever markup a page may be made to hold, it stays still.
std::string policy_for(std::string_view script) {
  return "default-src 'none'; style-src 'unsafe-inline'; script-src " + policy_hash(script) +
         "; img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'";
}

// JSON inside <script>: in JSON '<' and the line separators U+2028, U+2029 occur in texts only, where they can be
// written as escapes, and without '<' no tag and no comment begins.
std::string harmless_json(std::string_view json) {
  std::string out;
  out.reserve(json.size() + json.size() / 64);
  for (std::size_t at = 0; at < json.size(); ++at) {
    const std::string_view rest = json.substr(at, 3);
    if (json[at] == '<') {
      out += "\\u003c";
    } else if (rest == "\xe2\x80\xa8" || rest == "\xe2\x80\xa9") {
      out += rest[2] == '\xa8' ? "\\u2028" : "\\u2029";
      at += 2;
    } else {
      out += json[at];
    }
  }
  return out;
}

bool same_letters(std::string_view text, std::string_view lower) {
  return text.size() >= lower.size() && std::equal(lower.begin(), lower.end(), text.begin(), [](char a, char b) {
           return a == static_cast<char>(std::tolower(static_cast<unsigned char>(b)));
         });
}

// Script or style inside its element: what would end the element, or open a comment, gets a backslash, which changes
// nothing inside texts, the only place where it can occur.
std::string harmless_code(std::string_view code) {
  std::string out;
  out.reserve(code.size() + 16);
  for (std::size_t at = 0; at < code.size(); ++at) {
    const std::string_view rest = code.substr(at);
    out += code[at];
    if (same_letters(rest, "</script") || same_letters(rest, "</style") || rest.starts_with("<!--")) out += '\\';
  }
  return out;
}

}  // namespace

std::string report_html(const ReportData& data, const Viewer& viewer) {
  const std::string script = harmless_code(viewer.script);
  std::string page = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">";
  page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  page += "<meta http-equiv=\"Content-Security-Policy\" content=\"" + policy_for(script) + "\">\n";
  page += "<title>" + escaped_markup(data.title) + " – Grapnel</title>\n";
  page += "<style>" + harmless_code(viewer.style) + "</style></head>\n";
  page +=
      "<body><main id=\"report\"><noscript>This report needs JavaScript, which it holds itself.</noscript></main>\n";
  page += "<script type=\"application/json\" id=\"grapnel-data\">" + harmless_json(data.json) + "</script>\n";
  page += "<script>" + script + "</script></body></html>\n";
  return page;
}

std::size_t write_report(const ReportData& data, const std::filesystem::path& path) {
  const Viewer viewer = embedded_viewer();
  if (viewer.empty()) throw std::runtime_error("this program was built without the report's viewer");
  const std::string page = report_html(data, viewer);
  write_file_atomically(path, page);
  return page.size();
}

Viewer embedded_viewer() {
#ifdef GRAPNEL_HAS_VIEWER
  return {{grapnel_viewer_script, grapnel_viewer_script_end}, {grapnel_viewer_style, grapnel_viewer_style_end}};
#else
  return {};
#endif
}

}  // namespace grapnel
