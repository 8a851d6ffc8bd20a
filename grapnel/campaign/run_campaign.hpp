#pragma once

/// @file
/// Runs what is missing of a campaign on the threads of one machine. Thread safety: reentrant for different stores.

#include <functional>
#include <span>
#include <stop_token>

#include "grapnel/campaign/run_block.hpp"
#include "grapnel/campaign/shard_store.hpp"

namespace grapnel {

struct CampaignProgress {
  std::uint64_t done = 0;        // cases there are, those of earlier runs included
  std::uint64_t begun_with = 0;  // of them there when this run began
  std::uint64_t total = 0;       // that this run is about: of all its blocks
  std::uint64_t successes = 0;   // of those done
  std::uint64_t not_ok = 0;      // of those done: status failed or unreachable
  bool stopped = false;          // on request, before all were done
};

struct CampaignOptions {
  int threads = 1;
  std::uint64_t shard = 0, shards = 1;  // of a job array: only blocks whose number is `shard` modulo `shards`
  /// One call at a time, from the thread that called run_campaign(): several times a second, done or not.
  std::function<void(const CampaignProgress&)> progress;
  std::stop_token stop;
  double hand_in = 20;  // [s] after which the rows of a long block are written, as far as they are there
};

/// Computes what is missing on `threads` threads; the calling one alone writes. At a stop request the cases under way
/// are given up, and all complete ones are kept. Rethrows what writing or computing throws; what is on disk stays.
/// Memory is bounded by a few blocks per thread.
CampaignProgress run_campaign(const BlockWork& work, ShardStore& store, const CampaignOptions& options);

/// Rows of one block from the first `rows` on, in parts of about a second. `part` is told of new rows, and takes the
/// rows so far if `now_due` says so. Inside run_campaign() and for ranks. Returns all rows there are: fewer than the
/// block's after a stop request.
struct BlockParts {
  std::function<void(std::span<const CampaignRow> fresh)> fresh;              // after every part
  std::function<void(const std::vector<CampaignRow>& so_far)> worth_keeping;  // every `hand_in` seconds
  double hand_in = 20;                                                        // [s]
};
std::vector<CampaignRow> run_block(const BlockWork& work, const Block& block, std::vector<CampaignRow> rows,
                                   std::uint64_t& part_size, const BlockParts& parts, const std::stop_token& stop);

}  // namespace grapnel
