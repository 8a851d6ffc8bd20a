#pragma once

/// @file
/// timeseries.mat: all series as one MATLAB struct. docs/formats/timeseries.md is its contract.

#include <filesystem>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Writes a compressed MAT file of version 5 with one struct `grapnel`: `plot(grapnel.time, grapnel.base.position)`.
/// Written atomically and read back before it takes its name; throws std::runtime_error naming the path and the reason
/// (above 2 GiB of data, too: the format ends there), or std::invalid_argument (check_time_series).
void write_timeseries_mat(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                          const std::filesystem::path& path);

}  // namespace grapnel
