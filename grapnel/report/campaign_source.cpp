#include "grapnel/report/campaign_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

namespace grapnel {
namespace {

// Splitmix64's finalizer (Steele, Lea and Flood 2014): as good as random, and the same everywhere.
std::uint64_t hash_of(std::uint64_t k) {
  k += 0x9e3779b97f4a7c15u;
  k = (k ^ (k >> 30)) * 0xbf58476d1ce4e5b9u;
  k = (k ^ (k >> 27)) * 0x94d049bb133111ebu;
  return k ^ (k >> 31);
}

// Of `rows`, the `most` whose k has the least hash.
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
    throw table.fault("it is of another campaign than campaign.json");
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

}  // namespace grapnel
