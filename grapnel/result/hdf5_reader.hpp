#pragma once

/// @file
/// Reader of timeseries.h5, for exports and reports. A child process reads the file: HDF5 can crash or loop endlessly
/// on a damaged or hostile file, and the checksum at its end (file_seal.hpp) does not protect against deliberate
/// changes.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Contents of a file without samples.
struct TimeSeriesHead {
  TimeSeriesMetadata metadata;
  TimeSeries names;           // phases and series, without samples
  std::uint64_t samples = 0;  // in the file
  std::uint64_t every = 1;    // every n-th sample is read, and the first and the last of each phase
};

/// Reads a file block by block, so that memory does not grow with its samples: `begin` first, then `take` in order.
/// If the numbers need more than `most_bytes`, samples are omitted (TimeSeriesHead::every). Throws std::runtime_error
/// naming the path and the error: missing, not HDF5, truncated, damaged, another schema, inconsistent sizes. Calls of
/// several threads are serialized.
void read_timeseries_blocks(const std::filesystem::path& path, std::uint64_t most_bytes,
                            const std::function<void(const TimeSeriesHead&)>& begin,
                            const std::function<void(const TimeSeries& block)>& take);

/// Reads the whole file into at most about `most_bytes`: the series and the head, whose `every` states whether samples
/// are omitted.
struct ReadTimeSeries {
  TimeSeriesHead head;
  TimeSeries series;
};
ReadTimeSeries read_timeseries(const std::filesystem::path& path,
                               std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max());

/// Memory limit for a page or a figure, sufficient for more samples than they can show.
inline constexpr std::uint64_t kShownBytes = 512'000'000;

}  // namespace grapnel
