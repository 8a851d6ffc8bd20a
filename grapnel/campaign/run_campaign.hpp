#pragma once

/// @file
/// Runs the cases of a sweep, or the missing cases of a campaign, on the threads of one machine, and estimates the
/// duration before the run. Thread safety: reentrant for different stores.

#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "grapnel/study/case_pool.hpp"

namespace grapnel {

struct CampaignOptions : PoolOptions {
  std::uint64_t shard = 0, shards = 1;  // for a job array: only blocks whose number is `shard` modulo `shards`
  double hand_in = 20;                  // [s] after which the available rows of a long block are written
};

/// Computes the missing cases on `threads` threads; only the calling thread writes. At a stop request incomplete cases
/// are abandoned, and all complete ones are stored. Rethrows exceptions of writing and computing; files on disk remain.
/// Memory is bounded by a few blocks per thread.
CaseProgress run_campaign(const BlockWork& work, ShardStore& store, const CampaignOptions& options);

/// All rows of a sweep, in the order of their points. `take` receives them in that order, as soon as all earlier rows
/// are complete. The rows are identical, bit for bit, for any number of threads. After a stop request it returns the
/// first ones.
std::vector<CaseRow> run_sweep(const Campaign& sweep, const PoolOptions& options,
                               const std::function<void(const CaseRow&)>& take = {});

// --- Parts of run_campaign(), for running blocks on other machines ---

/// Missing blocks of a campaign, or of one part of it, and its progress.
CaseProgress progress_of(const ShardStore& store, std::vector<ShardStore::Missing>& missing, std::uint64_t shard = 0,
                         std::uint64_t shards = 1);

/// Computes the missing rows of one block in parts of about a second and passes each part on. Returns all rows, or
/// fewer after a stop request. `part_size`: number of cases, adapted from block to block.
void run_block(const BlockWork& work, const ShardStore::Missing& missing, std::uint64_t& part_size,
               const std::function<void(std::vector<CaseRow>)>& hand_in, const std::stop_token& stop);

/// Collects the rows of a block and writes them when they are complete; rows of a long block also in intervals before.
class BlockInProgress {
 public:
  /// `keep_after`: [s] between writes.
  BlockInProgress(ShardStore& store, const ShardStore::Missing& missing, double keep_after = CampaignOptions{}.hand_in);
  /// The block's next rows. @throws as ShardStore::write()
  void add(std::vector<CaseRow> fresh);
  /// Writes rows that are not on disk yet. @throws as ShardStore::write()
  void keep();
  bool is_complete() const { return block_.begin + rows_.size() == block_.end; }

 private:
  ShardStore& store_;
  Block block_;
  double keep_after_;
  std::chrono::steady_clock::time_point kept_;
  std::vector<CaseRow> rows_;
  bool unkept_ = false;  // some rows are not written yet
};

// Estimated duration of a campaign and its causes, reported before the start; not part of any result.

struct CampaignEstimate {
  double seconds = 0;       // for all missing cases
  std::uint64_t cases = 0;  // missing cases
  int threads = 1;
};

/// Computes increasing numbers of missing cases until they take a third of a second, and extrapolates from the last.
/// Their rows are discarded. `now` reads a clock [s]. An estimate below `quick` [s] is not refined, although larger
/// blocks take less time per case. Empty if no cases are missing, or after a stop request. Rethrows exceptions of
/// `work`.
std::optional<CampaignEstimate> estimate_campaign(const BlockWork& work, std::span<const ShardStore::Missing> missing,
                                                  int threads, double quick, const std::function<double()>& now,
                                                  const std::stop_token& stop = {});

/// "about 3 min for 100000 cases on 8 threads".
std::string estimate_text(const CampaignEstimate& estimate);

/// Causes of long run times, one line each, with the setting that changes them: found by simulating case `k` alone.
/// Segments that are not integrated in lanes with the reason, monitors, plans per case, many steps. Empty without such
/// causes, or without a case.
std::vector<std::string> slow_settings(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop = {});

}  // namespace grapnel
