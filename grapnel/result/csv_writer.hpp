#pragma once

/// @file
/// timeseries.csv: all series in one table. docs/formats/timeseries.md is its contract.

#include <filesystem>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// One row per sample; the columns are `time [s]`, `phase` (its name), then `base/position/x [m]` and so on. Numbers
/// read back to the same double. Written atomically; throws std::runtime_error naming the path and the reason, or
/// std::invalid_argument (check_time_series).
void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path);

/// The same from timeseries.h5, block by block: memory does not grow with the samples. Throws as
/// read_timeseries_blocks() and write_timeseries_csv().
void copy_timeseries_csv(const std::filesystem::path& timeseries, const std::filesystem::path& path);

}  // namespace grapnel
