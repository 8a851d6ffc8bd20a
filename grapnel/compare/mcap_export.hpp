#pragma once

/// @file
/// A run's time series as an MCAP file for Foxglove; docs/formats/timeseries.md is its contract.

#include <filesystem>
#include <string>

namespace grapnel {

/// Reads `folder`/timeseries.h5, writes timeseries.mcap beside it (atomically, block by block) and returns its path.
/// Throws std::runtime_error naming the file and the reason.
std::filesystem::path export_mcap(const std::filesystem::path& folder, const std::string& version);

}  // namespace grapnel
