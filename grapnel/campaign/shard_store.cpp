#include "grapnel/campaign/shard_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

#include "grapnel/result/atomic_file.hpp"

namespace grapnel {
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
         "\nchoose another folder with -o, or take back the change; to add cases to a campaign that is there, leave "
         "its "
         "file as it is and use --extend";
}

}  // namespace

ShardStore::ShardStore(fs::path folder, const Campaign& campaign, const StoreOptions& options)
    : folder_(made(std::move(folder))), campaign_(campaign), lock_(folder_, options.writer) {
  refuse_link(folder_ / "shards");
  make_folder(folder_ / "shards");
  if (options.writer.empty()) {  // nobody else writes here
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
  // The same command after a kill goes on.
  if (!manifest_.added.empty() && manifest_.added.back() == cases && !missing().empty()) return;
  raise_total(manifest_.total + cases);
}

void ShardStore::raise_total(std::uint64_t total) {
  if (total > kMostCases)
    throw ForeignFolder(fmt::format("the campaign would have {} cases, at most {} are possible", total, kMostCases));
  manifest_.added.push_back(total - manifest_.total);
  manifest_.total = total;
  write_manifest(folder_, manifest_);
  known_.clear();  // the last block may have become longer
}

// Whose files are there: looking into the folder is much quicker than for every file that may be in it.
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

ShardStore::Known ShardStore::look_at(const Block& block) const {
  if (block.number >= known_.size()) known_.resize(block.number + 1);
  Known& known = known_[block.number];
  if (known.rows == block.end - block.begin) return known;  // complete ones stay
  known = {};
  for (const CaseRow& row : rows(block)) {
    ++known.rows;
    if (row.success) ++known.successes;
    if (row.status != CaseStatus::ok) ++known.not_ok;
  }
  return known;
}

std::vector<ShardStore::Missing> ShardStore::missing(std::uint64_t shard, std::uint64_t shards,
                                                     StoreCounts* counts) const {
  std::vector<Missing> list;
  StoreCounts found;
  const std::uint64_t blocks = block_count(manifest_.block_size, manifest_.total);
  const std::vector<bool> there_is = present(blocks);
  for (std::uint64_t number = shard; number < blocks; number += shards) {
    const Block block = block_at(number, manifest_.block_size, manifest_.total);
    const Known there = there_is[number] ? look_at(block) : Known{};
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
  if (!manifest) throw std::runtime_error(folder.string() + ": no campaign is there (manifest.json is missing)");
  const std::uint64_t blocks = block_count(manifest->block_size, manifest->total);
  for (std::uint64_t number = 0; number < blocks; ++number) {
    auto rows =
        read_shard(folder, campaign, block_at(number, manifest->block_size, manifest->total), manifest->arithmetic);
    if (rows) take(std::move(*rows));
  }
}

}  // namespace grapnel
