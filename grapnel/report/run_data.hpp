#pragma once

/// @file
/// A run's result folder as a report holds it. Inside this module only.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// RunData of web/src/data.ts. What is odd about scene.json or timeseries.h5 becomes a note. @throws std::runtime_error
/// naming path and fault where there is no summary to go by.
nlohmann::ordered_json run_data(const std::filesystem::path& folder, const std::string& label);

/// What a browser still opens of a time series.
inline constexpr std::size_t kMostSeriesBytes = 100'000'000;

/// PackedSeries of web/src/data.ts: as many samples as fit into about 1.5 MB, or more where decimate() leaves out no
/// more. @throws std::runtime_error where that are more than `most_bytes`.
nlohmann::ordered_json packed_series(const TimeSeries& series, std::size_t most_bytes = kMostSeriesBytes);

/// A message without the folder before its files' names: pages do not say where results lie.
std::string without_folder(std::string text, const std::filesystem::path& folder);

/// The last part of a folder's path, also where that ends with "/" or "..".
std::string folder_name(const std::filesystem::path& folder);

}  // namespace grapnel
