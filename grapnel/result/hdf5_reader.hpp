#pragma once

/// @file
/// timeseries.h5 read back, for exports and reports.

#include <filesystem>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// What write_timeseries_hdf5 wrote. Throws std::runtime_error naming the path and the fault: missing, not HDF5,
/// truncated, damaged, not ours, sizes that disagree. Thread safety: may be called from several threads; they take
/// turns.
TimeSeries read_timeseries_hdf5(const std::filesystem::path& path);
TimeSeriesMetadata read_timeseries_metadata(const std::filesystem::path& path);

}  // namespace grapnel
