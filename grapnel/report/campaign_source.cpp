#include "grapnel/report/campaign_source.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <set>
#include <stdexcept>

#include "grapnel/report/base64.hpp"
#include "grapnel/report/report_data.hpp"
#include "grapnel/report/run_data.hpp"
#include "grapnel/report/study_data.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Splitmix64's finalizer (Steele, Lea and Flood 2014): pseudo-random, and identical on all machines.
std::uint64_t hash_of(std::uint64_t k) {
  k += 0x9e3779b97f4a7c15u;
  k = (k ^ (k >> 30)) * 0xbf58476d1ce4e5b9u;
  k = (k ^ (k >> 27)) * 0x94d049bb133111ebu;
  return k ^ (k >> 31);
}

// The `most` rows whose k has the smallest hash.
std::vector<std::size_t> least_hashed(std::vector<std::size_t> rows, const std::vector<std::uint64_t>& index,
                                      std::size_t most) {
  if (rows.size() <= most) return rows;
  const auto less = [&](std::size_t a, std::size_t b) {
    const std::uint64_t x = hash_of(index[a]), y = hash_of(index[b]);
    return x != y ? x < y : a < b;
  };
  std::nth_element(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(most), rows.end(), less);
  rows.resize(most);
  return rows;
}

using Picked = std::vector<std::pair<std::size_t, bool>>;

std::vector<CampaignColumn> read_columns(const CampaignTable& table, const std::vector<CampaignTable::Head>& heads,
                                         const std::vector<std::string>& names, const Picked& picked) {
  std::vector<CampaignColumn> columns;
  for (const std::string& name : names) {
    const auto head = std::find_if(heads.begin(), heads.end(), [&](const auto& one) { return one.name == name; });
    if (head == heads.end()) throw table.fault(fmt::format("it has no '{}'", name));
    const std::vector<float> all = table.numbers<float>(*head);
    CampaignColumn column{*head};
    column.values.reserve(picked.size());
    for (const auto& [row, drawn] : picked) column.values.push_back(all[row]);
    columns.push_back(std::move(column));
  }
  return columns;
}

void read_reasons(const CampaignTable& table, const Picked& picked, CampaignRows& result) {
  const std::vector<std::int32_t> all = table.reasons();
  std::vector<std::int32_t> numbers;  // of those that occur
  for (const auto& [row, drawn] : picked)
    if (all[row] != 0) numbers.push_back(all[row]);
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  const std::vector<std::string> texts = table.reason_texts(numbers);
  for (std::size_t i = 0; i < picked.size(); ++i) {
    const std::int32_t number = all[picked[i].first];
    const auto found = std::lower_bound(numbers.begin(), numbers.end(), number);
    if (number != 0) result.reasons.emplace_back(i, texts[static_cast<std::size_t>(found - numbers.begin())]);
  }
}

}  // namespace

std::vector<std::pair<std::size_t, bool>> sampled_rows(const std::vector<std::uint64_t>& index,
                                                       const std::vector<std::uint8_t>& success,
                                                       const CampaignQuery& query) {
  std::vector<std::size_t> all(index.size());
  for (std::size_t row = 0; row < all.size(); ++row) all[row] = row;
  std::vector<std::size_t> without;
  for (const std::size_t row : all)
    if (row < success.size() && success[row] == 0) without.push_back(row);
  const std::vector<std::size_t> even = least_hashed(std::move(all), index, query.most);
  std::set<std::size_t> added;
  for (const std::size_t row : least_hashed(std::move(without), index, query.most_without_success)) added.insert(row);
  const std::set<std::uint64_t> asked(query.cases.begin(), query.cases.end());
  for (std::size_t row = 0; row < index.size(); ++row)
    if (asked.contains(index[row])) added.insert(row);
  std::vector<std::pair<std::size_t, bool>> picked;
  for (const std::size_t row : even) {
    picked.emplace_back(row, true);
    added.erase(row);
  }
  for (const std::size_t row : added) picked.emplace_back(row, false);
  std::sort(picked.begin(), picked.end());
  return picked;
}

CampaignRows read_campaign_rows(const std::filesystem::path& path, const CampaignQuery& query) {
  const CampaignTable table(path);
  if (!query.sha256.empty() && table.sha256() != query.sha256)
    throw table.fault("it belongs to another campaign than campaign.json");
  CampaignRows result;
  result.table_rows = table.rows();
  result.statuses = table.status_names();
  const std::vector<std::uint64_t> index = table.indices();
  const std::vector<std::uint8_t> success = table.success(), status = table.status();
  const Picked picked = sampled_rows(index, success, query);
  for (const auto& [row, drawn] : picked) {
    if (status[row] >= result.statuses.size()) throw table.fault("damaged: 'status' counts beyond its names");
    result.index.push_back(index[row]);
    result.drawn.push_back(drawn ? 1 : 0);
    result.status.push_back(status[row]);
    result.success.push_back(success[row] != 0 ? 1 : 0);
  }
  read_reasons(table, picked, result);
  result.design = read_columns(table, table.design(), query.design, picked);
  result.inputs = read_columns(table, table.inputs(), query.inputs, picked);
  result.columns = read_columns(table, table.columns(), query.columns, picked);
  return result;
}

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostRows = 5000;           // limit of distinguishable points in a chart
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

// Cases listed in campaign.json: the worst cases, and examples of failed ones.
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

// The command for a single case, in the result folder, if the settings name the campaign file.
std::string case_command(const Json& statistics, const fs::path& folder) {
  const Json::json_pointer file("/campaign/file");
  if (!statistics.contains(file) || !statistics.at(file).is_string()) return {};
  const std::string name = statistics.at(file).get<std::string>();
  return fmt::format("grapnel campaign {} --only {{K}}", shell_word(seen_from_results(folder / "manifest.json", name)));
}

// The command of each case that campaign.json names, which is for the folder of the campaign file.
void name_folder(Json& statistics, const std::string& command) {
  for (const auto& [list, members] :
       {std::pair{"worst", "cases"}, std::pair{"reasons", "examples"}, std::pair{"failures", "examples"}}) {
    const auto found = statistics.find(list);
    if (command.empty() || found == statistics.end() || !found->is_array()) continue;
    for (Json& entry : *found) {
      const auto cases = entry.is_object() ? entry.find(members) : entry.end();
      if (!entry.is_object() || cases == entry.end() || !cases->is_array()) continue;
      for (Json& one : *cases) {
        if (!one.is_object() || !one.contains("replay") || !one.contains("index")) continue;
        if (one["index"].is_number_unsigned())
          one["replay"] = command.substr(0, command.size() - 3) + std::to_string(one["index"].get<std::uint64_t>());
      }
    }
  }
}

// Cases with separate reports, in increasing order.
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
    throw TooLarge(
        fmt::format("{}: {:.0f} MB exceed the limit of a report; select fewer columns with 'columns' in the campaign",
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
      notes.push_back(fmt::format("table.h5 has {} rows, but campaign.json has {}: they belong to different runs.",
                                  table_rows, counted->get<std::uint64_t>()));
  } catch (const std::exception& error) {
    notes.push_back("No single cases, only statistics: " + without_folder(error.what(), folder));
  }
  std::string command = case_command(statistics, folder);
  name_folder(statistics, command);
  return {{"statistics", std::move(statistics)}, {"command", std::move(command)}, {"rows", table_rows},
          {"sample", std::move(sample)},         {"notes", std::move(notes)},     {"saved", saved}};
}

}  // namespace grapnel
