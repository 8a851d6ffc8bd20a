#pragma once

/// @file
/// A result folder's time series in other formats.

#include <filesystem>

namespace grapnel {

/// Reads `folder`/timeseries.h5, writes timeseries.csv or timeseries.mat beside it (atomically) and returns its path.
/// Throws std::runtime_error naming the file and the reason. Thread safety: reentrant on different folders; export_mat
/// one thread at a time.
std::filesystem::path export_csv(const std::filesystem::path& folder);
std::filesystem::path export_mat(const std::filesystem::path& folder);

}  // namespace grapnel
