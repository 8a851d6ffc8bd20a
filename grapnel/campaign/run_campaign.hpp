#pragma once

/// @file
/// Runs the cases of a sweep, or what is missing of a campaign, on the threads of one machine, and says beforehand how
/// long that will take. Thread safety: reentrant for different stores.

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
  std::uint64_t shard = 0, shards = 1;  // of a job array: only blocks whose number is `shard` modulo `shards`
  double hand_in = 20;  // [s] after which the rows of a long block are written, as far as they are there
};

/// Computes what is missing on `threads` threads; the calling one alone writes. At a stop request the cases under way
/// are given up, and all complete ones are kept. Rethrows what writing or computing throws; what is on disk stays.
/// Memory is bounded by a few blocks per thread.
CaseProgress run_campaign(const BlockWork& work, ShardStore& store, const CampaignOptions& options);

/// All rows of a sweep, in the order of their points. `take` gets them in that order too, as soon as those before them
/// are there. The same rows, bit for bit, for any number of threads. After a stop request the first ones.
std::vector<CaseRow> run_sweep(const Campaign& sweep, const PoolOptions& options,
                               const std::function<void(const CaseRow&)>& take = {});

// --- Of which run_campaign() is made, for those who run blocks on other machines ---

/// What is missing of a campaign, or of one part of it, and how far it is.
CaseProgress progress_of(const ShardStore& store, std::vector<ShardStore::Missing>& missing, std::uint64_t shard = 0,
                         std::uint64_t shards = 1);

/// Computes the missing rows of one block in parts of about a second, each of which is handed in. All of them, or fewer
/// after a stop request. `part_size`: in cases; made to fit from block to block.
void run_block(const BlockWork& work, const ShardStore::Missing& missing, std::uint64_t& part_size,
               const std::function<void(std::vector<CaseRow>)>& hand_in, const std::stop_token& stop);

/// The rows of a block so far, which are written when they are all there, and of a long block now and then before.
class BlockOnItsWay {
 public:
  /// `keep_after`: [s] between writes.
  BlockOnItsWay(ShardStore& store, const ShardStore::Missing& missing, double keep_after = CampaignOptions{}.hand_in);
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
  bool unkept_ = false;  // some rows are not on disk
};

// How long a campaign will take, and what in it makes that long. Told to people before it starts; no part of any
// result.

struct CampaignEstimate {
  double seconds = 0;       // for all that is missing
  std::uint64_t cases = 0;  // that are missing
  int threads = 1;
};

/// Computes a few of the missing cases, more and more of them until that takes a third of a second, and takes the last
/// ones' time for that of all. Their rows are not kept. `now` reads a clock [s]. An estimate below `quick` [s] is not
/// made better: more cases at once take less time each. Nothing where nothing is missing, or after a stop request.
/// Rethrows what `work` throws.
std::optional<CampaignEstimate> estimate_campaign(const BlockWork& work, std::span<const ShardStore::Missing> missing,
                                                  int threads, double quick, const std::function<double()>& now,
                                                  const std::stop_token& stop = {});

/// "about 3 min for 100000 cases on 8 threads".
std::string estimate_text(const CampaignEstimate& estimate);

/// What makes the campaign's cases take long, a line each, with the setting that changes it: found by simulating case
/// `k` alone. Pieces of motion that are not for lanes and why, what is watched, plans per case, many steps. Empty where
/// there is nothing of the kind, or no case.
std::vector<std::string> slow_settings(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop = {});

}  // namespace grapnel
