#pragma once

/// @file
/// timeseries.h5: sampled quantities as HDF5. docs/formats/timeseries.md is its contract.

#include <cstdint>
#include <filesystem>
#include <memory>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Writes atomically: the file at `path` is the previous or the new one, complete. The same series gives the same
/// bytes. Throws std::runtime_error naming the path and the reason, or std::invalid_argument (check_time_series).
/// Series without components are left out. Thread safety: may be called from several threads; calls are serialized.
void write_timeseries_hdf5(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                           const std::filesystem::path& path);

/// Writes samples as they arrive, with one block in memory. Until finish() the file has a temporary name.
class TimeSeriesFile : public SeriesSink {
 public:
  TimeSeriesFile(std::filesystem::path path, TimeSeriesMetadata metadata);
  ~TimeSeriesFile() override;
  TimeSeriesFile(const TimeSeriesFile&) = delete;
  TimeSeriesFile& operator=(const TimeSeriesFile&) = delete;

  /// Accepts the samples even if the disk is full, so that the run continues; finish() throws the error.
  void take(TimeSeries& block) override;
  /// Writes the last block and renames the file to its final name. Without samples no file is written. Throws as
  /// write_timeseries_hdf5().
  void finish(TimeSeries& last);
  /// Number of samples written so far.
  std::uint64_t samples() const { return samples_; }

 private:
  class Growing;
  void append(const TimeSeries& block);

  std::filesystem::path path_;
  TimeSeriesMetadata metadata_;
  std::uint64_t samples_ = 0;
  std::vector<std::string> phases_;  // latest names
  std::unique_ptr<Growing> file_;    // null: no samples yet, or writing failed
  std::string fault_;                // not empty: the reason for which writing stopped
};

}  // namespace grapnel
