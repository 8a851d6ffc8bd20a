#pragma once

/// @file
/// timeseries.h5 read back, for exports and reports. The file is read in a child process: HDF5 can crash or loop
/// without end on a damaged or hostile file, and the checksum at its end (file_seal.hpp) is no protection against
/// intent.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// What a file holds.
struct TimeSeriesHead {
  TimeSeriesMetadata metadata;
  TimeSeries names;           // phases and series, without samples
  std::uint64_t samples = 0;  // in the file
  std::uint64_t every = 1;    // of them every n-th is read, and the first and the last of each phase
};

/// Reads a file block by block, so that memory does not grow with its samples: `begin` first, then `take` in order.
/// Where the numbers would take more than `most_bytes`, some samples are left out (TimeSeriesHead::every). Throws
/// std::runtime_error naming the path and the fault: missing, not HDF5, truncated, damaged, not ours, sizes that
/// disagree. Several threads take turns.
void read_timeseries_blocks(const std::filesystem::path& path, std::uint64_t most_bytes,
                            const std::function<void(const TimeSeriesHead&)>& begin,
                            const std::function<void(const TimeSeries& block)>& take);

/// All at once, in at most about `most_bytes`: the series and the head, whose `every` tells whether samples are left
/// out.
struct ReadTimeSeries {
  TimeSeriesHead head;
  TimeSeries series;
};
ReadTimeSeries read_timeseries(const std::filesystem::path& path,
                               std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max());

/// What a page or a figure is made from at most: more samples than any can show.
inline constexpr std::uint64_t kShownBytes = 512'000'000;

}  // namespace grapnel
