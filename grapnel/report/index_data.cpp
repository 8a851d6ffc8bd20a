#include "grapnel/report/index_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <vector>

#include "grapnel/report/run_data.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kMaxDepth = 12;                // of folders below the given one
constexpr std::size_t kMaxResults = 20'000;  // on the page

// An answer as in summary.json.
Json answer(const char* question, const char* tone, std::string word, std::string sentence) {
  return {{"question", question}, {"tone", tone}, {"word", std::move(word)}, {"sentence", std::move(sentence)}};
}

template <class T>
T value_of(const Json& document, const char* pointer, T otherwise) {
  const Json::json_pointer at(pointer);
  if (!document.contains(at)) return otherwise;
  const Json& found = document.at(at);
  if constexpr (std::is_same_v<T, std::string>) return found.is_string() ? found.get<std::string>() : otherwise;
  if constexpr (std::is_same_v<T, double>) return found.is_number() ? found.get<double>() : otherwise;
}

std::string count_at(const Json& document, const char* pointer) {
  return fmt::format("{:.0f}", value_of(document, pointer, 0.0));
}

// Name and answers of a result, from its characteristic file.
void describe_run(const fs::path& folder, Json& entry) {
  const fs::path path = folder / "summary.json";
  const Json summary = read_json_document(path, "grapnel-summary/2", "grapnel-summary/1");
  entry["title"] = required_text(summary, "/scenario/name", path);
  entry["version"] = value_of(summary, "/version", std::string());
  if (summary.contains("verdicts") && summary["verdicts"].is_array()) {
    for (const Json& one : summary["verdicts"]) {
      if (!one.is_object()) continue;
      entry["answers"].push_back({{"question", one.value("question", "")},
                                  {"tone", one.value("tone", "none")},
                                  {"word", one.value("word", "")},
                                  {"sentence", one.value("sentence", "")}});
    }
  }
  if (value_of(summary, "/status", std::string()) == "failed")
    entry["answers"].push_back(answer("Run", "bad", "Failed", value_of(summary, "/failure", std::string())));
}

void describe_sweep(const fs::path& folder, Json& entry) {
  const fs::path path = folder / "study.json";
  const Json study = read_json_document(path, "grapnel-study-table/1");
  entry["title"] = required_text(study, "/study/name", path);
  entry["version"] = value_of(study, "/version", std::string());
  const bool failed = value_of(study, "/failed", 0.0) > 0;
  entry["answers"].push_back(answer("Points", failed ? "warn" : "good", count_at(study, "/points") + " points",
                                    fmt::format("{} completed, {} failed, {} unreachable", count_at(study, "/ok"),
                                                count_at(study, "/failed"), count_at(study, "/unreachable"))));
}

void describe_campaign(const fs::path& folder, Json& entry) {
  const fs::path path = folder / "campaign.json";
  const Json campaign = read_json_document(path, "grapnel-campaign-report/1");
  entry["title"] = required_text(campaign, "/campaign/name", path);
  entry["version"] = value_of(campaign, "/version", std::string());
  const Json::json_pointer estimate("/success/estimate");
  if (!campaign.contains(estimate) || !campaign.at(estimate).is_number()) {
    entry["answers"].push_back(answer("Success", "none", "No cases", ""));
    return;
  }
  entry["answers"].push_back(answer(
      "Success", "none", fmt::format("{:.3g} %", 100 * campaign.at(estimate).get<double>()),
      fmt::format("{} of {} cases; {:.3g} to {:.3g} % at {:.3g} % confidence", count_at(campaign, "/counts/success"),
                  count_at(campaign, "/rows"), 100 * value_of(campaign, "/success/lower", 0.0),
                  100 * value_of(campaign, "/success/upper", 1.0),
                  100 * value_of(campaign, "/success/confidence", 0.0))));
}

void describe_optimization(const fs::path& folder, Json& entry) {
  const fs::path path = folder / "comparison.json";
  const Json best = read_json_document(path, "grapnel-optimization-result/1");
  entry["title"] = required_text(best, "/optimization/name", path);
  entry["version"] = value_of(best, "/version", std::string());
  const Json::json_pointer after("/objective/after");
  if (!best.contains(after) || !best.at(after).is_number()) {
    entry["answers"].push_back(answer("Best point", "bad", "None", value_of(best, "/why", std::string())));
    return;
  }
  const Json::json_pointer before("/objective/before");
  const std::string from = best.contains(before) && best.at(before).is_number()
                               ? fmt::format("{:.4g} to ", best.at(before).get<double>())
                               : "";
  entry["answers"].push_back(
      answer("Best point", "good", "Found",
             fmt::format("{} from {}{:.4g} {}", value_of(best, "/objective/name", std::string("objective")), from,
                         best.at(after).get<double>(), value_of(best, "/objective/unit", std::string()))));
}

struct IndexedKind {
  ResultKind kind;
  const char* name;
  const char* file;
  void (*describe)(const fs::path&, Json&);
};
constexpr IndexedKind kIndexedKinds[] = {
    {ResultKind::run, "run", "summary.json", describe_run},
    {ResultKind::sweep, "sweep", "study.json", describe_sweep},
    {ResultKind::optimization, "optimization", "comparison.json", describe_optimization},
    {ResultKind::campaign, "campaign", "campaign.json", describe_campaign}};

double seconds_of(const fs::path& file) {
  std::error_code error;
  const fs::file_time_type time = fs::last_write_time(file, error);
  if (error) return 0;
  const auto system = std::chrono::file_clock::to_sys(time);
  return std::chrono::duration<double>(std::chrono::floor<std::chrono::seconds>(system.time_since_epoch())).count();
}

// comparison.json has two kinds: of optimizations, and of comparisons with logs, which are no result folders.
bool is_of_kind(const fs::path& folder, const IndexedKind& kind) {
  std::error_code error;
  if (!fs::exists(folder / kind.file, error)) return false;
  return kind.kind != ResultKind::optimization || fs::exists(folder / "evaluations.csv", error);
}

// The entry of a folder; null: it holds no result.
Json entry_of(const fs::path& folder, const fs::path& page_folder) {
  std::vector<const IndexedKind*> found;
  for (const IndexedKind& kind : kIndexedKinds) {
    if (is_of_kind(folder, kind)) found.push_back(&kind);
  }
  if (found.empty()) return nullptr;
  const IndexedKind& kind = *found.front();
  const fs::path seen = fs::absolute(folder).lexically_normal().lexically_relative(page_folder);
  std::error_code error;
  Json entry{{"kind", kind.name},
             {"path", seen.generic_string()},
             {"title", folder_name(folder)},
             {"time", seconds_of(folder / kind.file)},
             {"version", ""},
             {"report", fs::exists(folder / "report.html", error)},
             {"answers", Json::array()},
             {"fault", ""}};
  try {
    kind_of_results(folder);
    kind.describe(folder, entry);
  } catch (const std::exception& fault) {
    entry["fault"] = without_folder(fault.what(), folder);
  }
  return entry;
}

// Folders below a result belong to it: series and shards of campaigns.
void collect(const fs::path& folder, const fs::path& page_folder, int depth, std::vector<Json>& entries) {
  if (entries.size() >= kMaxResults) return;
  Json entry = entry_of(folder, page_folder);
  if (!entry.is_null()) {
    entries.push_back(std::move(entry));
    return;
  }
  if (depth >= kMaxDepth) return;
  std::error_code error;
  std::vector<fs::path> below;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (!at->is_symlink(ignored) && at->is_directory(ignored)) below.push_back(at->path());
  }
  std::sort(below.begin(), below.end());
  for (const fs::path& one : below) collect(one, page_folder, depth + 1, entries);
}

}  // namespace

ReportData index_data(const fs::path& folder, const fs::path& page, std::string_view version) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw std::runtime_error(
        fmt::format("{}: {}", folder.string(), fs::exists(folder, error) ? "not a folder" : "no such folder"));
  std::vector<Json> entries;
  collect(folder, fs::absolute(page).lexically_normal().parent_path(), 0, entries);
  if (entries.empty())
    throw std::runtime_error(fmt::format("{}: no results in this folder and the folders below it", folder.string()));
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Json& a, const Json& b) { return a["time"].get<double>() > b["time"].get<double>(); });
  const std::string title = "Results in " + folder_name(folder);
  Json index{{"results", std::move(entries)}, {"limit", kMaxResults}};
  return page_data("index", title, std::move(index), version);
}

}  // namespace grapnel
