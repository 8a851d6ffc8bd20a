#pragma once

/// @file
/// Time series in other formats than HDF5: timeseries.csv and timeseries.mat. docs/formats/timeseries.md is their
/// contract.

#include <filesystem>
#include <set>
#include <string>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

// ---- timeseries.csv: all series in one table ----

/// One row per sample; the columns are `time [s]`, `phase` (its name), then `base/position/x [m]` and so on. Numbers
/// read back to the same double. Written atomically; throws std::runtime_error naming the path and the reason, or
/// std::invalid_argument (check_time_series).
void write_timeseries_csv(const TimeSeries& series, const std::filesystem::path& path);

/// The same from timeseries.h5, block by block: memory does not grow with the samples. Throws as
/// read_timeseries_blocks() and write_timeseries_csv().
void copy_timeseries_csv(const std::filesystem::path& timeseries, const std::filesystem::path& path);

// ---- timeseries.mat: all series as one MATLAB struct ----

/// `name` converted similarly to MATLAB's makeValidName: letters, digits and _, beginning with a letter (else an x is
/// prepended), no keyword, at most 63 characters.
std::string matlab_name(const std::string& name);

/// The same, made unique in `taken` by a suffix _2, _3, ..., and added to `taken`.
std::string unique_matlab_name(const std::string& name, std::set<std::string>& taken);

/// Writes a compressed MAT file of version 5 with one struct `grapnel`: `plot(grapnel.time, grapnel.base.position)`.
/// Written atomically and read back before it takes its name; throws std::runtime_error naming the path and the reason
/// (above 2 GiB of data, too: the format ends there), or std::invalid_argument (check_time_series).
void write_timeseries_mat(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                          const std::filesystem::path& path);

// ---- Of a result folder ----

/// Reads `folder`/timeseries.h5, writes timeseries.csv or timeseries.mat beside it (atomically) and returns its path.
/// Throws std::runtime_error naming the file and the reason. Thread safety: reentrant on different folders; export_mat
/// one thread at a time.
std::filesystem::path export_csv(const std::filesystem::path& folder);
std::filesystem::path export_mat(const std::filesystem::path& folder);

}  // namespace grapnel
