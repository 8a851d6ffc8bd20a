#pragma once

/// @file
/// Storage of a campaign's rows: one file per block with its first rows or all rows; files are replaced atomically.
/// docs/formats/campaign.md is the files' contract. Thread safety: one thread writes; missing() and write() are called
/// by one thread at a time.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_lock.hpp"
#include "grapnel/campaign/manifest.hpp"

namespace grapnel {

// --- One shard: rows of consecutive cases in a small HDF5 file with a seal. ---

/// DIR/shards/000012.h5.
std::filesystem::path shard_path(const std::filesystem::path& folder, std::uint64_t number);

/// The bytes of a shard: rows with consecutive indices, all with as many inputs and values. The same rows give the same
/// bytes, and the same rows bit for bit when they are read. `arithmetic`: see arithmetic_here().
std::string shard_bytes(const Campaign& campaign, const std::vector<CaseRow>& rows, const std::string& arithmetic);

/// Rows of a block on disk: all, or the first ones if the block was incomplete at the last write (RunCampaign writes
/// long blocks in parts). Empty if the file is absent, damaged, or of another campaign, another arithmetic or other
/// cases.
std::optional<std::vector<CaseRow>> read_shard(const std::filesystem::path& folder, const Campaign& campaign,
                                               const Block& block, const std::string& arithmetic);

/// The same for many blocks, in order: `take` receives the rows of each, or nothing. A child process reads the files,
/// so that a file that crashes HDF5 counts as damaged. @throws std::runtime_error without a process; what `take` throws
void read_shards(const std::filesystem::path& folder, const Campaign& campaign, const std::vector<Block>& blocks,
                 const std::string& arithmetic,
                 const std::function<void(const Block&, std::optional<std::vector<CaseRow>>)>& take);

// --- The folder ---

/// A folder with another campaign, or with contents that this campaign cannot continue.
struct ForeignFolder : StoreError {
  using StoreError::StoreError;
};

struct StoreOptions {
  std::string version;          // the program's
  std::string writer;           // of several that write to one folder (ranks, tasks of a job array); empty: alone
  std::uint64_t extend = 0;     // cases to add; the same value continues an incomplete extension
  std::uint64_t total = 0;      // minimum number of all cases, as in other folders of the campaign
  std::string arithmetic = {};  // of the written rows; empty: that of this machine
};

/// What is on disk.
struct StoreCounts {
  std::uint64_t rows = 0, successes = 0, not_ok = 0;
  std::uint64_t blocks = 0, complete = 0;  // all of them, those with all rows
};

class ShardStore {
 public:
  /// Opens or creates DIR for writing: takes the lock, compares the manifest, removes leftovers of killed writers (if
  /// no others write), adds the cases of an extension.
  /// @throws FolderInUse, ForeignFolder, DamagedManifest, std::runtime_error (disk)
  ShardStore(std::filesystem::path folder, const Campaign& campaign, const StoreOptions& options);
  ~ShardStore();
  ShardStore(const ShardStore&) = delete;
  ShardStore& operator=(const ShardStore&) = delete;

  /// All cases of the campaign, those of extensions included.
  std::uint64_t total() const { return manifest_.total; }
  std::uint64_t block_size() const { return manifest_.block_size; }
  /// Of all rows in the folder.
  const std::string& arithmetic() const { return manifest_.arithmetic; }
  /// Whether the folder had a campaign before.
  bool was_there() const { return was_there_; }
  const std::filesystem::path& folder() const { return folder_; }

  /// An incomplete block and the number of its rows on disk.
  struct Missing {
    Block block;
    std::uint64_t rows = 0;  // number of first rows on disk
  };
  /// Blocks with numbers `shard` modulo `shards` that are not complete, increasing. Reads those shards (complete ones
  /// once); damaged ones count as absent. `counts`, if given, receives the counts of these blocks.
  std::vector<Missing> missing(std::uint64_t shard = 0, std::uint64_t shards = 1, StoreCounts* counts = nullptr) const;
  /// The rows of a block on disk. Any thread.
  std::vector<CaseRow> rows(const Block& block) const;
  /// Writes the first rows of a block, or all. @throws std::runtime_error with path and reason; the previous file
  /// remains.
  void write(const Block& block, const std::vector<CaseRow>& rows);

 private:
  struct Known {
    std::uint32_t rows = 0, successes = 0, not_ok = 0;
  };

  void begin(const StoreOptions& options);
  void extend(std::uint64_t cases);
  void raise_total(std::uint64_t total);
  std::vector<bool> present(std::uint64_t blocks) const;
  void learn(const std::vector<Block>& blocks) const;

  std::filesystem::path folder_;
  const Campaign& campaign_;
  CampaignLock lock_;
  Manifest manifest_;
  bool was_there_ = false;
  mutable std::vector<Known> known_;  // per block, as last seen
};

/// Calls `take` with the rows in a campaign's folder, a block at a time, in the order of the indices. Rows that are
/// absent, damaged or of another campaign are skipped. @throws std::runtime_error if there is no manifest.
void for_each_block(const std::filesystem::path& folder, const Campaign& campaign,
                    const std::function<void(std::vector<CaseRow>&&)>& take);

}  // namespace grapnel
