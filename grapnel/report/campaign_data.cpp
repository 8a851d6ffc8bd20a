#include "grapnel/report/study_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "grapnel/report/base64.hpp"
#include "grapnel/report/campaign_source.hpp"
#include "grapnel/report/report_data.hpp"
#include "grapnel/report/run_data.hpp"
#include "grapnel/report/shell_word.hpp"
#include "grapnel/report/study_source.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostRows = 5000;           // more than that no chart shows apart
constexpr std::size_t kMostSampled = 1'000'000;   // of the sample: about 5 MB
constexpr std::size_t kLargestJson = 50'000'000;  // [bytes]

std::vector<std::string> names_of(const Json& list, const fs::path& path, const std::string& key) {
  std::vector<std::string> names;
  for (const Json& entry : list) names.push_back(text_of(entry, "name", path, key));
  return names;
}

// Numbers at `key` of the objects in a list, wherever they are numbers.
void add_indices(const Json& list, std::vector<std::uint64_t>& cases) {
  if (!list.is_array()) return;
  for (const Json& entry : list) {
    if (!entry.is_object()) continue;
    const auto index = entry.find("index");
    if (index != entry.end() && index->is_number_unsigned()) cases.push_back(index->get<std::uint64_t>());
  }
}

// The cases that campaign.json names one by one: the worst, and examples of those that failed.
std::vector<std::uint64_t> named_cases(const Json& statistics) {
  std::vector<std::uint64_t> cases;
  for (const auto& [list, members] :
       {std::pair{"worst", "cases"}, std::pair{"reasons", "examples"}, std::pair{"failures", "examples"}}) {
    const auto found = statistics.find(list);
    if (found == statistics.end() || !found->is_array()) continue;
    for (const Json& entry : *found)
      if (entry.is_object() && entry.contains(members)) add_indices(entry[members], cases);
  }
  return cases;
}

// How a case is looked at, where the settings say which file the campaign was.
std::string case_command(const Json& statistics) {
  const Json::json_pointer file("/campaign/file");
  if (!statistics.contains(file) || !statistics.at(file).is_string()) return {};
  return fmt::format("grapnel campaign {} --only {{K}}", shell_word(statistics.at(file).get<std::string>()));
}

// Cases with a report of their own beside the folder's, in increasing order.
std::vector<std::uint64_t> saved_cases(const fs::path& folder) {
  constexpr std::string_view kCase = "case-";
  std::vector<std::uint64_t> cases;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "series", none)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kCase) || !fs::is_regular_file(entry.path() / "report.html", none)) continue;
    std::uint64_t k = 0;
    const char* const last = name.data() + name.size();
    const auto [end, error] = std::from_chars(name.data() + kCase.size(), last, k);
    if (error == std::errc() && end == last) cases.push_back(k);
  }
  std::sort(cases.begin(), cases.end());
  return cases;
}

CampaignQuery query_of(const Json& statistics, const fs::path& path, const std::vector<std::uint64_t>& saved) {
  CampaignQuery query;
  const Json::json_pointer hash("/campaign/sha256");
  if (statistics.contains(hash) && statistics.at(hash).is_string())
    query.sha256 = statistics.at(hash).get<std::string>();
  query.inputs = names_of(list_of(statistics, "inputs", path), path, "inputs");
  query.columns = names_of(list_of(statistics, "columns", path), path, "columns");
  const Json::json_pointer axes("/success_map/axes");
  if (statistics.contains(axes)) query.design = names_of(statistics.at(axes), path, "success_map.axes");
  query.cases = named_cases(statistics);
  query.cases.insert(query.cases.end(), saved.begin(), saved.end());
  const std::size_t width = query.design.size() + query.inputs.size() + query.columns.size() + 2;
  query.most = std::clamp<std::size_t>(kMostSampled / width, 200, kMostRows);
  return query;
}

Json columns_json(const std::vector<CampaignColumn>& columns) {
  Json list = Json::array();
  for (const CampaignColumn& c : columns) {
    Json entry{{"name", c.name}, {"unit", c.unit}, {"description", c.description}};
    if (!c.labels.empty()) entry["labels"] = c.labels;
    entry["data"] = base64_of(std::span<const float>(c.values));
    list.push_back(std::move(entry));
  }
  return list;
}

Json sample_json(const CampaignRows& rows) {
  const std::vector<double> index(rows.index.begin(), rows.index.end());
  Json reasons = Json::array();
  for (const auto& [row, text] : rows.reasons) reasons.push_back(Json::array({row, text}));
  return {{"rows", rows.index.size()},
          {"case", base64_of(std::span<const double>(index))},
          {"drawn", base64_of(std::span<const std::uint8_t>(rows.drawn))},
          {"status", base64_of(std::span<const std::uint8_t>(rows.status))},
          {"statuses", rows.statuses},
          {"success", base64_of(std::span<const std::uint8_t>(rows.success))},
          {"reasons", std::move(reasons)},
          {"design", columns_json(rows.design)},
          {"inputs", columns_json(rows.inputs)},
          {"columns", columns_json(rows.columns)}};
}

}  // namespace

Json campaign_data(const fs::path& folder) {
  const fs::path path = folder / "campaign.json";
  std::error_code ignored;
  if (const auto bytes = fs::file_size(path, ignored); !ignored && bytes > kLargestJson)
    throw TooLarge(fmt::format("{}: {:.0f} MB are too much for a report; choose fewer with 'columns' in the campaign",
                               path.string(), static_cast<double>(bytes) / 1e6));
  Json statistics = read_json_document(path, "grapnel-campaign-report/1");
  const std::vector<std::uint64_t> saved = saved_cases(folder);
  const CampaignQuery query = query_of(statistics, path, saved);
  Json sample = nullptr, notes = Json::array();
  std::uint64_t table_rows = 0;
  try {
    const CampaignRows rows = read_campaign_rows(folder / "table.h5", query);
    table_rows = rows.table_rows;
    sample = sample_json(rows);
    const auto counted = statistics.find("rows");
    if (counted != statistics.end() && counted->is_number_unsigned() && counted->get<std::uint64_t>() != table_rows)
      notes.push_back(fmt::format("table.h5 has {} rows where campaign.json has {}: they were not made together.",
                                  table_rows, counted->get<std::uint64_t>()));
  } catch (const std::exception& error) {
    notes.push_back("No single cases, only statistics: " + without_folder(error.what(), folder));
  }
  std::string command = case_command(statistics);
  return {{"statistics", std::move(statistics)}, {"command", std::move(command)}, {"rows", table_rows},
          {"sample", std::move(sample)},         {"notes", std::move(notes)},     {"saved", saved}};
}

}  // namespace grapnel
