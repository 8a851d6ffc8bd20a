#pragma once

/// @file
/// One shard: rows of consecutive cases in a small HDF5 file with a seal. docs/formats/campaign.md is its contract.
/// Thread safety: free functions; HDF5's part takes turns.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/campaign/run_block.hpp"

namespace grapnel {

/// DIR/shards/000012.h5.
std::filesystem::path shard_path(const std::filesystem::path& folder, std::uint64_t number);

/// The bytes of a shard: rows with consecutive indices, all with as many inputs and values. The same rows give the same
/// bytes, and the same rows bit for bit when they are read. `arithmetic`: what they were made with.
std::string shard_bytes(const Campaign& campaign, const std::vector<CaseRow>& rows, const std::string& arithmetic);

/// Rows of a block on disk: all, or the first ones if it was not complete when it was written last (RunCampaign hands
/// in long blocks in parts). Nothing if the file is absent, damaged, of another campaign, of another arithmetic, or of
/// other cases.
std::optional<std::vector<CaseRow>> read_shard(const std::filesystem::path& folder, const Campaign& campaign,
                                                   const Block& block, const std::string& arithmetic);

}  // namespace grapnel
