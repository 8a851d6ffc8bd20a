#pragma once

/// @file
/// timeseries.h5: sampled quantities as HDF5. docs/formats/timeseries.md is its contract.

#include <filesystem>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Writes atomically: the file at `path` is the previous or the new one, complete. The same series gives the same
/// bytes. Throws std::runtime_error naming the path and the reason, or std::invalid_argument (check_time_series).
/// Series without components are left out. Thread safety: may be called from several threads; they take turns.
void write_timeseries_hdf5(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                           const std::filesystem::path& path);

}  // namespace grapnel
