#pragma once

/// @file
/// How long a campaign will take, and what in it makes that long. Told to people before it starts; no part of any
/// result.

#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/campaign/run_block.hpp"
#include "grapnel/campaign/shard_store.hpp"

namespace grapnel {

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
