#include "grapnel/campaign/shard_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/child_reader.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

using hdf5::check;
using hdf5::Handle;

constexpr const char* kShardSchema = "grapnel-campaign-shard/2";

// Identity of the campaign, stored in all its shards.
std::string identity(const Campaign& campaign) { return fmt::format("{} {}", campaign.sha256, campaign.seed); }

// A table of numbers by rows. HDF5 has no empty extents along rows: without columns no table is written.
void write_numbers(const Handle& file, const char* name, const std::vector<CaseRow>& rows,
                   std::vector<double> CaseRow::*numbers) {
  const std::size_t width = (rows.front().*numbers).size();
  if (width == 0) return;
  std::vector<double> all;
  all.reserve(rows.size() * width);
  for (const CaseRow& row : rows) {
    if ((row.*numbers).size() != width) throw std::logic_error("rows of a shard differ in their number of columns");
    all.insert(all.end(), (row.*numbers).begin(), (row.*numbers).end());
  }
  // No compression: random numbers do not compress, and shards are read once or twice.
  hdf5::write_dataset(file, name, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {rows.size(), width}, all.data()}, false);
}

// Reasons repeat: each text is stored once.
void write_reasons(const Handle& file, const std::vector<CaseRow>& rows) {
  std::vector<std::string> texts;
  std::vector<std::int32_t> which;  // -1: none
  for (const CaseRow& row : rows) {
    if (row.reason.empty()) {
      which.push_back(-1);
      continue;
    }
    std::size_t at = 0;
    while (at < texts.size() && texts[at] != row.reason) ++at;
    if (at == texts.size()) texts.push_back(row.reason);
    which.push_back(static_cast<std::int32_t>(at));
  }
  hdf5::write_dataset(file, "reason", {H5T_STD_I32LE, H5T_NATIVE_INT32, {which.size()}, which.data()}, false);
  if (!texts.empty()) hdf5::write_strings(file, "reasons", texts);
}

std::string image_of(const Campaign& campaign, const std::vector<CaseRow>& rows, const std::string& arithmetic) {
  const hdf5::Session session;
  const Handle file = hdf5::create_in_memory("shard");
  {
    const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
    hdf5::write_attribute(root, "schema", std::string(kShardSchema));
    hdf5::write_attribute(root, "campaign", identity(campaign));
    hdf5::write_attribute(root, "arithmetic", arithmetic);
    std::vector<std::uint64_t> index;
    std::vector<std::uint8_t> status, success;
    for (const CaseRow& row : rows) {
      index.push_back(row.index);
      status.push_back(static_cast<std::uint8_t>(row.status));
      success.push_back(row.success ? 1 : 0);
    }
    hdf5::write_dataset(file, "case", {H5T_STD_U64LE, H5T_NATIVE_UINT64, {index.size()}, index.data()}, false);
    hdf5::write_dataset(file, "status", {H5T_STD_U8LE, H5T_NATIVE_UINT8, {status.size()}, status.data()}, false);
    hdf5::write_dataset(file, "success", {H5T_STD_U8LE, H5T_NATIVE_UINT8, {success.size()}, success.data()}, false);
    write_numbers(file, "inputs", rows, &CaseRow::inputs);
    write_numbers(file, "columns", rows, &CaseRow::values);
    write_reasons(file, rows);
  }
  return hdf5::image_of(file);
}

// --- Reading in a child process: a file with a valid seal can still crash HDF5. Files that do not fit the campaign are
// foreign ---

struct Foreign {};  // thrown

Handle open_image(const std::string& bytes) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "file access");
  check(H5Pset_fapl_core(access.id(), 1 << 20, false), "file in memory");
  std::string copy = bytes;  // HDF5 requires a non-const pointer
  check(H5Pset_file_image(access.id(), copy.data(), copy.size()), "file in memory");
  return {H5Fopen("shard", H5F_ACC_RDONLY, access.id()), H5Fclose, "shard"};
}

// All numbers of a dataset of `rows` rows of `width`.
template <class T>
std::vector<T> read_numbers(const Handle& file, const char* name, hid_t type, std::size_t rows, std::size_t width) {
  if (width == 0) return {};
  const Handle dataset(H5Dopen2(file.id(), name, H5P_DEFAULT), H5Dclose, name);
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  if (H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(rows * width)) throw Foreign{};
  std::vector<T> numbers(rows * width);
  check(H5Dread(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), name);
  return numbers;
}

std::size_t length_of(const Handle& file, const char* name) {
  const Handle dataset(H5Dopen2(file.id(), name, H5P_DEFAULT), H5Dclose, name);
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  return static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.id()));
}

std::vector<std::string> read_texts(const Handle& file, const char* name) {
  const Handle dataset(H5Dopen2(file.id(), name, H5P_DEFAULT), H5Dclose, name);
  const Handle stored(H5Dget_type(dataset.id()), H5Tclose, name);
  const Handle type = hdf5::string_type(H5Tget_cset(stored.id()) == H5T_CSET_ASCII);
  const Handle space(H5Dget_space(dataset.id()), H5Sclose, name);
  std::vector<char*> pointers(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.id())), nullptr);
  check(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()), name);
  std::vector<std::string> texts;
  for (const char* text : pointers) texts.emplace_back(text == nullptr ? "" : text);
  H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, pointers.data());
  return texts;
}

std::vector<CaseRow> rows_of(const Handle& file, const Campaign& campaign, const Block& block,
                             const std::string& arithmetic) {
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
  if (hdf5::read_string_attribute(root, "schema") != kShardSchema ||
      hdf5::read_string_attribute(root, "campaign") != identity(campaign) ||
      hdf5::read_string_attribute(root, "arithmetic") != arithmetic)
    throw Foreign{};
  const std::size_t count = length_of(file, "case"), inputs = campaign.inputs.size(), columns = campaign.columns.size();
  if (count == 0 || count > block.end - block.begin) throw Foreign{};
  const auto index = read_numbers<std::uint64_t>(file, "case", H5T_NATIVE_UINT64, count, 1);
  const auto status = read_numbers<std::uint8_t>(file, "status", H5T_NATIVE_UINT8, count, 1);
  const auto success = read_numbers<std::uint8_t>(file, "success", H5T_NATIVE_UINT8, count, 1);
  const auto reason = read_numbers<std::int32_t>(file, "reason", H5T_NATIVE_INT32, count, 1);
  const auto drawn = read_numbers<double>(file, "inputs", H5T_NATIVE_DOUBLE, count, inputs);
  const auto values = read_numbers<double>(file, "columns", H5T_NATIVE_DOUBLE, count, columns);
  std::vector<std::string> texts;
  if (H5Lexists(file.id(), "reasons", H5P_DEFAULT) > 0) texts = read_texts(file, "reasons");
  std::vector<CaseRow> rows(count);
  for (std::size_t i = 0; i < count; ++i) {
    CaseRow& row = rows[i];
    const auto text = static_cast<std::size_t>(std::max(reason[i], 0));
    if (index[i] != block.begin + i || status[i] > static_cast<std::uint8_t>(CaseStatus::unreachable) ||
        (reason[i] >= 0 && text >= texts.size()))
      throw Foreign{};
    row.index = index[i];
    row.status = static_cast<CaseStatus>(status[i]);
    row.success = success[i] != 0;
    if (reason[i] >= 0) row.reason = texts[text];
    row.inputs.assign(drawn.begin() + static_cast<std::ptrdiff_t>(i * inputs),
                      drawn.begin() + static_cast<std::ptrdiff_t>((i + 1) * inputs));
    row.values.assign(values.begin() + static_cast<std::ptrdiff_t>(i * columns),
                      values.begin() + static_cast<std::ptrdiff_t>((i + 1) * columns));
  }
  return rows;
}

}  // namespace

std::filesystem::path shard_path(const std::filesystem::path& folder, std::uint64_t number) {
  return folder / "shards" / fmt::format("{:06}.h5", number);
}

std::string shard_bytes(const Campaign& campaign, const std::vector<CaseRow>& rows, const std::string& arithmetic) {
  if (rows.empty()) throw std::logic_error("a shard without rows");
  for (const CaseRow& row : rows) {
    if (row.values.size() != campaign.columns.size() || row.inputs.size() != campaign.inputs.size())
      throw std::logic_error(fmt::format("case {} is not complete", row.index));
  }
  std::string bytes = image_of(campaign, rows, arithmetic);
  seal(bytes);
  return bytes;
}

namespace {

// In the child, which has its own state of HDF5.
std::optional<std::vector<CaseRow>> rows_in_file(const std::filesystem::path& path, const Campaign& campaign,
                                                 const Block& block, const std::string& arithmetic) {
  try {
    std::string bytes = file_bytes(path);
    const std::size_t sealed = bytes.size();
    unseal(bytes);
    if (bytes.size() == sealed) return std::nullopt;  // truncated: every shard has a seal
    const Handle file = open_image(bytes);
    return rows_of(file, campaign, block, arithmetic);
  } catch (const Foreign&) {
    return std::nullopt;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void send_shard(ToParent& parent, const std::optional<std::vector<CaseRow>>& rows) {
  parent.count(rows ? rows->size() : 0);  // a shard has at least one row
  if (!rows) return;
  for (const CaseRow& row : *rows) {
    parent.count(row.index);
    parent.count(static_cast<std::uint64_t>(row.status));
    parent.count(row.success ? 1 : 0);
    parent.text(row.reason);
    parent.numbers(row.inputs);
    parent.numbers(row.values);
  }
}

std::optional<std::vector<CaseRow>> take_shard(FromChild& child, const Campaign& campaign, const Block& block) {
  const std::uint64_t count = child.count();
  if (count == 0) return std::nullopt;
  if (count > block.end - block.begin) throw std::runtime_error("damaged: a shard has too many rows");
  std::vector<CaseRow> rows;
  rows.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    CaseRow row;
    row.index = child.count();
    const std::uint64_t status = child.count();
    row.success = child.count() != 0;
    row.reason = child.text();
    row.inputs = child.numbers<double>();
    row.values = child.numbers<double>();
    if (row.index != block.begin + i || status > static_cast<std::uint64_t>(CaseStatus::unreachable) ||
        row.inputs.size() != campaign.inputs.size() || row.values.size() != campaign.columns.size())
      throw std::runtime_error("damaged: a row of a shard is invalid");
    row.status = static_cast<CaseStatus>(status);
    rows.push_back(std::move(row));
  }
  return rows;
}

double seconds_for(const std::filesystem::path& path) {
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);
  return none ? 0 : reading_seconds(static_cast<double>(size)) - reading_seconds(0);
}

}  // namespace

void read_shards(const std::filesystem::path& folder, const Campaign& campaign, const std::vector<Block>& blocks,
                 const std::string& arithmetic,
                 const std::function<void(const Block&, std::optional<std::vector<CaseRow>>)>& take) {
  // One child for many shards; if a shard crashes it, another child continues after that shard.
  for (std::size_t done = 0; done < blocks.size();) {
    const std::size_t begin = done;
    const auto send = [&](ToParent& parent) {
      for (std::size_t i = begin; i < blocks.size(); ++i)
        send_shard(parent, rows_in_file(shard_path(folder, blocks[i].number), campaign, blocks[i], arithmetic));
    };
    double seconds = reading_seconds(0);
    for (std::size_t i = begin; i < blocks.size(); ++i) seconds += seconds_for(shard_path(folder, blocks[i].number));
    bool taking = false;  // exceptions of `take` do not concern the shard
    try {
      std::optional<hdf5::Session> session(std::in_place);  // the child inherits HDF5 while no thread uses it
      read_in_child(seconds, send, [&](FromChild& child) {
        session.reset();
        while (done < blocks.size()) {
          auto rows = take_shard(child, campaign, blocks[done]);
          const Block& block = blocks[done++];
          taking = true;
          take(block, std::move(rows));
          taking = false;
        }
      });
    } catch (const NoProcess&) {
      throw;
    } catch (const std::exception&) {
      if (taking) throw;
      if (done == blocks.size()) return;
      const Block& damaged = blocks[done++];
      take(damaged, std::nullopt);
    }
  }
}

std::optional<std::vector<CaseRow>> read_shard(const std::filesystem::path& folder, const Campaign& campaign,
                                               const Block& block, const std::string& arithmetic) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(shard_path(folder, block.number), none)) return std::nullopt;
  std::optional<std::vector<CaseRow>> found;
  read_shards(folder, campaign, {block}, arithmetic,
              [&](const Block&, std::optional<std::vector<CaseRow>> rows) { found = std::move(rows); });
  return found;
}

namespace {

namespace fs = std::filesystem;

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error("cannot write " + folder.string() + ": " + error.message());
}

// The folder, before its lock is taken.
fs::path made(fs::path folder) {
  make_folder(folder);
  return folder;
}

std::string refusal(const fs::path& folder, const std::vector<std::string>& lines) {
  std::string text = fmt::format("'{}' holds another campaign:", folder.string());
  for (const std::string& line : lines) text += "\n  " + line;
  return text +
         "\nchoose another folder with -o, or revert the change; to add cases to an existing campaign, keep "
         "its "
         "file unchanged and use --extend";
}

}  // namespace

ShardStore::ShardStore(fs::path folder, const Campaign& campaign, const StoreOptions& options)
    : folder_(made(std::move(folder))), campaign_(campaign), lock_(folder_, options.writer) {
  refuse_link(folder_ / "shards");
  make_folder(folder_ / "shards");
  if (options.writer.empty()) {  // no other writer
    remove_leftovers(folder_, 0);
    remove_leftovers(folder_ / "shards", 0);
  }
  const CampaignLock::Turn turn(lock_);
  begin(options);
  if (options.extend > 0) extend(options.extend);
  if (options.total > manifest_.total) raise_total(options.total);
}

ShardStore::~ShardStore() = default;

void ShardStore::begin(const StoreOptions& options) {
  const std::string arithmetic = options.arithmetic.empty() ? arithmetic_here() : options.arithmetic;
  std::optional<Manifest> found = read_manifest(folder_);
  was_there_ = found.has_value();
  if (!found) {
    manifest_ = new_manifest(campaign_, options.version, arithmetic);
    manifest_.file_folder = folder_seen_from(folder_, campaign_.file);
    write_manifest(folder_, manifest_);
    return;
  }
  if (const std::vector<std::string> lines = differences(*found, campaign_, options.version, arithmetic);
      !lines.empty())
    throw ForeignFolder(refusal(folder_, lines));
  manifest_ = std::move(*found);
}

void ShardStore::extend(std::uint64_t cases) {
  if (!campaign_.design.empty())
    throw ForeignFolder(
        "--extend: a campaign over a design has as many cases at each of its points; change its file, and "
        "choose another folder with -o");
  if (cases > kMostCases)
    throw ForeignFolder(fmt::format("--extend {}: a campaign has at most {} cases", cases, kMostCases));
  // Rerunning the command after a kill continues the extension.
  if (!manifest_.added.empty() && manifest_.added.back() == cases && !missing().empty()) return;
  raise_total(manifest_.total + cases);
}

void ShardStore::raise_total(std::uint64_t total) {
  if (total > kMostCases)
    throw ForeignFolder(fmt::format("the campaign would have {} cases, the limit is {}", total, kMostCases));
  manifest_.added.push_back(total - manifest_.total);
  manifest_.total = total;
  write_manifest(folder_, manifest_);
  known_.clear();  // the last block may have become longer
}

// Blocks with existing files: listing the folder is much faster than testing every possible file.
std::vector<bool> ShardStore::present(std::uint64_t blocks) const {
  std::vector<bool> there(blocks);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "shards")) {
    const std::string name = entry.path().filename().string();
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (error == std::errc() && std::string_view(end) == ".h5" && number < blocks) there[number] = true;
  }
  return there;
}

// Reads only the blocks that are not known to be complete.
void ShardStore::learn(const std::vector<Block>& blocks) const {
  std::vector<Block> unknown;
  for (const Block& block : blocks) {
    if (block.number >= known_.size()) known_.resize(block.number + 1);
    if (known_[block.number].rows < block.end - block.begin) unknown.push_back(block);
  }
  read_shards(folder_, campaign_, unknown, manifest_.arithmetic,
              [&](const Block& block, const std::optional<std::vector<CaseRow>>& rows) {
                Known& known = known_[block.number];
                known = {};
                if (!rows) return;
                for (const CaseRow& row : *rows) {
                  ++known.rows;
                  if (row.success) ++known.successes;
                  if (row.status != CaseStatus::ok) ++known.not_ok;
                }
              });
}

std::vector<ShardStore::Missing> ShardStore::missing(std::uint64_t shard, std::uint64_t shards,
                                                     StoreCounts* counts) const {
  std::vector<Missing> list;
  StoreCounts found;
  const std::uint64_t blocks = block_count(manifest_.block_size, manifest_.total);
  const std::vector<bool> there_is = present(blocks);
  std::vector<Block> files;
  for (std::uint64_t number = shard; number < blocks; number += shards)
    if (there_is[number]) files.push_back(block_at(number, manifest_.block_size, manifest_.total));
  learn(files);
  for (std::uint64_t number = shard; number < blocks; number += shards) {
    const Block block = block_at(number, manifest_.block_size, manifest_.total);
    const Known there = there_is[number] ? known_[number] : Known{};
    ++found.blocks;
    if (there.rows < block.end - block.begin)
      list.push_back({block, there.rows});
    else
      ++found.complete;
    found.rows += there.rows;
    found.successes += there.successes;
    found.not_ok += there.not_ok;
  }
  if (counts != nullptr) *counts = found;
  return list;
}

std::vector<CaseRow> ShardStore::rows(const Block& block) const {
  return read_shard(folder_, campaign_, block, manifest_.arithmetic).value_or(std::vector<CaseRow>{});
}

void ShardStore::write(const Block& block, const std::vector<CaseRow>& rows) {
  write_file_atomically(shard_path(folder_, block.number), shard_bytes(campaign_, rows, manifest_.arithmetic));
}

void for_each_block(const fs::path& folder, const Campaign& campaign,
                    const std::function<void(std::vector<CaseRow>&&)>& take) {
  const std::optional<Manifest> manifest = read_manifest(folder);
  if (!manifest) throw std::runtime_error(folder.string() + ": not a campaign folder (manifest.json is missing)");
  const std::uint64_t blocks = block_count(manifest->block_size, manifest->total);
  std::vector<Block> all;
  for (std::uint64_t number = 0; number < blocks; ++number)
    all.push_back(block_at(number, manifest->block_size, manifest->total));
  read_shards(folder, campaign, all, manifest->arithmetic, [&](const Block&, std::optional<std::vector<CaseRow>> rows) {
    if (rows) take(std::move(*rows));
  });
}

}  // namespace grapnel
