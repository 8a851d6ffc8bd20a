// The page: whatever its data say, they stay data.

#include "grapnel/report/report_html.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace grapnel {
namespace report_html_test {

using testing::HasSubstr;
using testing::Not;

const Viewer kViewer{"viewer();", ":root{}"};

// What a browser takes for the text of the data's element.
std::string data_in(const std::string& page) {
  const std::string tag = "<script type=\"application/json\" id=\"grapnel-data\">";
  const std::size_t begin = page.find(tag) + tag.size();
  return page.substr(begin, page.find("</script", begin) - begin);
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++n;
  return n;
}

TEST(ReportHtml, HasItsParts) {
  const std::string page = report_html({"case 1", R"({"a":1})"}, kViewer);
  EXPECT_THAT(page, testing::StartsWith("<!doctype html>"));
  EXPECT_THAT(page, HasSubstr("<meta charset=\"utf-8\">"));
  EXPECT_THAT(page, HasSubstr("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy\" content=\"default-src 'none';"));
  EXPECT_THAT(page, HasSubstr("<title>case 1 – Grapnel</title>"));
  EXPECT_THAT(page, HasSubstr("<style>:root{}</style>"));
  EXPECT_THAT(page, HasSubstr("<main id=\"report\"><noscript>"));
  EXPECT_THAT(page, HasSubstr("<script>viewer();</script>"));
  EXPECT_EQ(data_in(page), R"({"a":1})");
  EXPECT_EQ(count(page, "http"), 1u);  // of http-equiv: the page names no address
}

// printf %s 'viewer();' | openssl dgst -sha256 -binary | base64
TEST(ReportHtml, ThePolicyAllowsTheViewersScriptAndNoOther) {
  const std::string page = report_html({"", "{}"}, kViewer);
  const std::size_t at = page.find("script-src ");
  const std::string sources = page.substr(at, page.find(';', at) - at);
  EXPECT_EQ(sources, "script-src 'sha256-XOaGvdj6Hts3rFNpowfjRz7z4KOG+Rq8zrEGk2LUP3Y='");
  EXPECT_THAT(page, HasSubstr("base-uri 'none'; form-action 'none'"));
  // For the text in the page, after escaping of the end of the element.
  EXPECT_THAT(report_html({"", "{}"}, {"a=\"</script>\";", ""}),
              HasSubstr("script-src 'sha256-7bVrHDyGl/u7a4KJ5JUdd8mRWFT8RH9G0VcTbzD85Qg='"));
}

TEST(ReportHtml, HostileTextsStayTexts) {
  const std::string hostile = "</script><img src=x onerror=alert(1)> <!-- <script> & \" \xe2\x80\xa8\xe2\x80\xa9 é";
  const nlohmann::json data{{"name", hostile}};
  const std::string page = report_html({hostile, data.dump()}, kViewer);
  EXPECT_EQ(count(page, "</script"), 2u);  // of the data and of the viewer
  EXPECT_EQ(count(page, "<script"), 2u);
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr("<!--")));
  EXPECT_THAT(data_in(page), Not(HasSubstr("\xe2\x80\xa8")));
  EXPECT_THAT(page, HasSubstr("<title>&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;"));
  EXPECT_EQ(nlohmann::json::parse(data_in(page))["name"], hostile);  // and nothing of them is lost
}

TEST(ReportHtml, TheViewersOwnTextsDoNotEndIt) {
  const std::string page =
      report_html({"", "{}"}, {R"(a="</script>";b="</SCRIPT>";c="<!--")", R"(a::after{content:"</style>"})"});
  EXPECT_THAT(page, HasSubstr(R"(a="<\/script>";b="<\/SCRIPT>";c="<\!--")"));
  EXPECT_THAT(page, HasSubstr(R"(content:"<\/style>")"));
}

TEST(ReportHtml, WritingWithoutAViewerIsAnError) {
  if (!embedded_viewer().empty()) GTEST_SKIP() << "built with the viewer";
  EXPECT_THROW(write_report({"", "{}"}, "/nowhere/report.html"), std::runtime_error);
}

TEST(ReportHtml, EmbeddedViewerIsComplete) {
  if (embedded_viewer().empty()) GTEST_SKIP() << "built without Node.js";
  const Viewer viewer = embedded_viewer();
  EXPECT_GT(viewer.script.size(), 100'000u);
  EXPECT_THAT(std::string(viewer.script), HasSubstr("grapnel-report/1"));
  EXPECT_THAT(std::string(viewer.style), HasSubstr("--ink"));
}

}  // namespace report_html_test
}  // namespace grapnel
