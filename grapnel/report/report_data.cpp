#include "grapnel/report/report_data.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "grapnel/report/run_data.hpp"
#include "grapnel/report/study_data.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A kind of results and its characteristic file.
struct Mark {
  ResultKind kind;
  const char* file;
  const char* of;
};
constexpr Mark kMarks[] = {{ResultKind::run, "summary.json", "grapnel run"},
                           {ResultKind::sweep, "study.json", "grapnel sweep"},
                           {ResultKind::optimization, "comparison.json", "grapnel optimize"},
                           {ResultKind::campaign, "campaign.json", "grapnel campaign"}};

ReportData finished(const char* kind, std::string title, Json runs, const char* key, Json value,
                    std::string_view version) {
  Json data{{"schema", "grapnel-report/1"}, {"version", version}, {"kind", kind}, {"title", title}};
  data["runs"] = std::move(runs);
  if (key) data[key] = std::move(value);
  return {std::move(title), data.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

std::string title_of(const Json& run) { return run["summary"]["scenario"]["name"].get<std::string>(); }

std::string text_at(const Json& document, const char* pointer, const fs::path& folder) {
  const Json::json_pointer at(pointer);
  return document.contains(at) && document.at(at).is_string() ? document.at(at).get<std::string>()
                                                              : folder_name(folder);
}

}  // namespace

ReportData page_data(const char* kind, std::string title, nlohmann::ordered_json value, std::string_view version) {
  return finished(kind, std::move(title), Json::array(), kind, std::move(value), version);
}

ResultKind kind_of_results(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw std::runtime_error(
        fmt::format("{}: {}", folder.string(), fs::exists(folder, error) ? "not a folder" : "no such folder"));
  std::vector<const Mark*> found;
  std::string expected;
  for (const Mark& mark : kMarks) {
    expected += fmt::format("{}{} (of {})", expected.empty() ? "" : ", ", mark.file, mark.of);
    if (fs::exists(folder / mark.file)) found.push_back(&mark);
  }
  if (found.empty()) throw std::runtime_error(fmt::format("{}: no results: expected {}", folder.string(), expected));
  if (found.size() > 1)
    throw std::runtime_error(fmt::format("{}: results of several kinds, {} (of {}) and {} (of {}): move one elsewhere",
                                         folder.string(), found[0]->file, found[0]->of, found[1]->file, found[1]->of));
  return found[0]->kind;
}

ReportData report_data(const fs::path& folder, std::string_view version, std::optional<ResultKind> kind) {
  switch (kind ? *kind : kind_of_results(folder)) {
    case ResultKind::sweep: {
      Json data = sweep_data(folder);
      std::string title = text_at(data, "/settings/study/name", folder);
      return page_data("sweep", std::move(title), std::move(data), version);
    }
    case ResultKind::optimization: {
      Json data = optimization_data(folder);
      std::string title = text_at(data, "/comparison/optimization/name", folder);
      return page_data("optimization", std::move(title), std::move(data), version);
    }
    case ResultKind::campaign: {
      Json data = campaign_data(folder);
      std::string title = text_at(data, "/statistics/campaign/name", folder);
      return page_data("campaign", std::move(title), std::move(data), version);
    }
    case ResultKind::run:
      break;
  }
  Json run = run_data(folder, "");
  std::string title = title_of(run);
  Json runs = Json::array();
  runs.push_back(std::move(run));
  return finished("run", std::move(title), std::move(runs), nullptr, nullptr, version);
}

ReportData comparison_data(const fs::path& a, const fs::path& b, std::string_view version) {
  for (const fs::path& folder : {a, b}) {
    if (kind_of_results(folder) != ResultKind::run)
      throw std::runtime_error(fmt::format("{}: not a run; only runs can be compared", folder.string()));
  }
  Json runs = Json::array();
  runs.push_back(run_data(a, "A"));
  runs.push_back(run_data(b, "B"));
  const std::string first = title_of(runs[0]), second = title_of(runs[1]);
  const std::string title = first == second ? first : first + " and " + second;
  return finished("comparison", title, std::move(runs), nullptr, nullptr, version);
}

}  // namespace grapnel
