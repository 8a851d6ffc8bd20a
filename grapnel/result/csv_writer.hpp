#pragma once

/// @file
/// timeseries.csv: all series in one table. docs/formats/timeseries.md is its contract.

#include <filesystem>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// One row per sample; the columns are `time [s]`, `phase` (its name), then `base/position/x [m]` and so on. Numbers
/// read back to the same double. Written atomically; throws std::runtime_error naming the path and the reason, or
/// std::invalid_argument (check_time_series). Thread safety: reentrant.
void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path);

}  // namespace grapnel
