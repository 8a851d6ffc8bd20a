#include "grapnel/report/campaign_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::check;
using hdf5::Handle;

constexpr const char* kSchema = "grapnel-campaign-table/1";

// An open table.h5. Read from disk: it may be larger than what memory should hold.
struct Table {
  std::uintmax_t bytes;
  Handle file;
};

Table open(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw std::runtime_error(fs::exists(path, error) ? "not a file" : "no such file");
  std::array<char, 8> begin{};
  std::ifstream stream(path, std::ios::binary);
  if (!stream.read(begin.data(), begin.size()) || std::string_view(begin.data(), begin.size()) != "\x89HDF\r\n\x1a\n")
    throw std::runtime_error("not an HDF5 file");
  check_file_seal(path);
  Table table{fs::file_size(path),
              Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "truncated or damaged")};
  const Handle root(H5Gopen2(table.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  const std::string schema = hdf5::read_string_attribute(root, "schema");
  if (schema != kSchema) throw std::runtime_error(fmt::format("schema is '{}', not {}", schema, kSchema));
  return table;
}

Handle dataset_of(const Table& table, const std::string& name) {
  return {H5Dopen2(table.file.id(), name.c_str(), H5P_DEFAULT), H5Dclose, fmt::format("no dataset '{}'", name)};
}

std::size_t length_of(const Table& table, const Handle& dataset, const std::string& name) {
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  hsize_t length = 0;
  if (H5Sget_simple_extent_ndims(space.id()) != 1 || H5Sget_simple_extent_dims(space.id(), &length, nullptr) < 0)
    throw std::runtime_error(fmt::format("damaged: '{}' is no list", name));
  // Deflate gains a factor of 1032 at most: larger claims are damage, and must not exhaust the memory.
  if (static_cast<double>(length) > 1100.0 * static_cast<double>(table.bytes))
    throw std::runtime_error(fmt::format("damaged: '{}' claims more than the file can hold", name));
  return static_cast<std::size_t>(length);
}

// All of a dataset, converted to T.
template <class T>
std::vector<T> whole(const Table& table, const Handle& dataset, hid_t memory_type, const std::string& name,
                     std::size_t rows) {
  if (length_of(table, dataset, name) != rows)
    throw std::runtime_error(fmt::format("damaged: '{}' has another length than 'k'", name));
  std::vector<T> values(rows);
  if (rows > 0)
    check(H5Dread(dataset.id(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
          fmt::format("damaged: '{}'", name));
  return values;
}

// The texts at some places of a list of texts.
std::vector<std::string> texts_at(const Table& table, const std::string& name, const std::vector<hsize_t>& places) {
  const Handle dataset = dataset_of(table, name);
  const std::size_t length = length_of(table, dataset, name);
  for (const hsize_t place : places)
    if (place >= length) throw std::runtime_error(fmt::format("damaged: '{}' has no text number {}", name, place));
  if (places.empty()) return {};
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  check(H5Sselect_elements(space.id(), H5S_SELECT_SET, places.size(), places.data()), name);
  const hsize_t count = places.size();
  const Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose, name);
  const Handle stored(H5Dget_type(dataset.id()), H5Tclose, name);
  if (H5Tis_variable_str(stored.id()) <= 0) throw std::runtime_error(fmt::format("damaged: '{}' are no texts", name));
  const Handle type = hdf5::string_type(H5Tget_cset(stored.id()) == H5T_CSET_ASCII);
  std::vector<char*> raw(places.size(), nullptr);
  check(H5Dread(dataset.id(), type.id(), memory.id(), space.id(), H5P_DEFAULT, raw.data()),
        fmt::format("damaged: '{}'", name));
  std::vector<std::string> texts;
  for (const char* text : raw) texts.emplace_back(text ? text : "");
  H5Dvlen_reclaim(type.id(), memory.id(), H5P_DEFAULT, raw.data());
  return texts;
}

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

// A column's dataset. Where its name cannot be one, as "captured/judged" beside "captured", it has another (written by
// GrowingDataset), and the attribute `name` tells it.
Handle column_dataset(const Table& table, const std::string& group, const std::string& name) {
  std::string other = name;
  std::replace(other.begin(), other.end(), '/', '.');
  constexpr int kMostTries = 4;
  std::string candidate = name;
  for (int i = 0; i <= kMostTries; ++i) {
    const std::string path = group + "/" + candidate;
    if (H5Oexists_by_name(table.file.id(), path.c_str(), H5P_DEFAULT) > 0) {
      Handle dataset = dataset_of(table, path);
      if (H5Aexists(dataset.id(), "name") <= 0 || hdf5::read_string_attribute(dataset, "name") == name) return dataset;
    }
    candidate = other + std::string(static_cast<std::size_t>(i), '_');
  }
  return dataset_of(table, group + "/" + name);  // which says that there is none
}

CampaignColumn read_column(const Table& table, const std::string& group, const std::string& name, const Picked& picked,
                           std::size_t rows) {
  const std::string path = group + "/" + name;
  const Handle dataset = column_dataset(table, group, name);
  CampaignColumn column{name, hdf5::read_string_attribute(dataset, "unit"),
                        hdf5::read_string_attribute(dataset, "description")};
  if (H5Aexists(dataset.id(), "names") > 0) column.labels = hdf5::read_strings_attribute(dataset, "names");
  const std::vector<float> all = whole<float>(table, dataset, H5T_NATIVE_FLOAT, path, rows);
  column.values.reserve(picked.size());
  for (const auto& [row, drawn] : picked) column.values.push_back(all[row]);
  return column;
}

std::vector<CampaignColumn> read_columns(const Table& table, const std::string& group,
                                         const std::vector<std::string>& names, const Picked& picked,
                                         std::size_t rows) {
  std::vector<CampaignColumn> columns;
  for (const std::string& name : names) columns.push_back(read_column(table, group, name, picked, rows));
  return columns;
}

void read_reasons(const Table& table, const Picked& picked, std::size_t rows, CampaignRows& result) {
  const Handle dataset = dataset_of(table, "reason");
  const std::vector<std::int64_t> all = whole<std::int64_t>(table, dataset, H5T_NATIVE_INT64, "reason", rows);
  std::vector<hsize_t> places;  // of those that occur
  for (const auto& [row, drawn] : picked) {
    if (all[row] < 0) throw std::runtime_error("damaged: 'reason' has a negative number");
    if (all[row] > 0) places.push_back(static_cast<hsize_t>(all[row]));
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const std::vector<std::string> texts = texts_at(table, "reasons", places);
  for (std::size_t i = 0; i < picked.size(); ++i) {
    const auto found = std::lower_bound(places.begin(), places.end(), static_cast<hsize_t>(all[picked[i].first]));
    if (all[picked[i].first] > 0)
      result.reasons.emplace_back(i, texts[static_cast<std::size_t>(found - places.begin())]);
  }
}

CampaignRows read(const Table& table, const CampaignQuery& query) {
  const Handle root(H5Gopen2(table.file.id(), "/", H5P_DEFAULT), H5Gclose, "damaged: no root group");
  if (!query.sha256.empty() && hdf5::read_string_attribute(root, "sha256") != query.sha256)
    throw std::runtime_error("it is of another campaign than campaign.json");
  CampaignRows result;
  const Handle k = dataset_of(table, "k");
  const std::size_t rows = length_of(table, k, "k");
  result.table_rows = rows;
  const std::vector<std::uint64_t> index = whole<std::uint64_t>(table, k, H5T_NATIVE_UINT64, "k", rows);
  const std::vector<std::uint8_t> success =
      whole<std::uint8_t>(table, dataset_of(table, "success"), H5T_NATIVE_UINT8, "success", rows);
  const Handle status_set = dataset_of(table, "status");
  const std::vector<std::uint8_t> status = whole<std::uint8_t>(table, status_set, H5T_NATIVE_UINT8, "status", rows);
  result.statuses = hdf5::read_strings_attribute(status_set, "names");
  const Picked picked = sampled_rows(index, success, query);
  for (const auto& [row, drawn] : picked) {
    if (status[row] >= result.statuses.size()) throw std::runtime_error("damaged: 'status' counts beyond its names");
    result.index.push_back(index[row]);
    result.drawn.push_back(drawn ? 1 : 0);
    result.status.push_back(status[row]);
    result.success.push_back(success[row] != 0 ? 1 : 0);
  }
  read_reasons(table, picked, rows, result);
  result.design = read_columns(table, "design", query.design, picked, rows);
  result.inputs = read_columns(table, "inputs", query.inputs, picked, rows);
  result.columns = read_columns(table, "columns", query.columns, picked, rows);
  return result;
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

CampaignRows read_campaign_rows(const fs::path& table, const CampaignQuery& query) {
  const hdf5::Session session;
  try {
    return read(open(table), query);
  } catch (const std::exception& e) {
    throw std::runtime_error("cannot read " + table.string() + ": " + e.what());
  }
}

}  // namespace grapnel
