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
/// Series without components are left out. Thread safety: may be called from several threads; they take turns.
void write_timeseries_hdf5(const TimeSeries& series, const TimeSeriesMetadata& metadata,
                           const std::filesystem::path& path);

/// The same while the samples come: only a block of them is in memory. Until finish() the file has a temporary name.
class TimeSeriesFile : public SeriesSink {
 public:
  TimeSeriesFile(std::filesystem::path path, TimeSeriesMetadata metadata);
  ~TimeSeriesFile() override;
  TimeSeriesFile(const TimeSeriesFile&) = delete;
  TimeSeriesFile& operator=(const TimeSeriesFile&) = delete;

  /// Takes the samples, also where the disk is full: that is thrown by finish(), so that the run goes on.
  void take(TimeSeries& block) override;
  /// Writes the last block and gives the file its name. Without any sample there is no file. Throws as
  /// write_timeseries_hdf5().
  void finish(TimeSeries& last);
  /// Written so far.
  std::uint64_t samples() const { return samples_; }

 private:
  class Growing;
  void append(const TimeSeries& block);

  std::filesystem::path path_;
  TimeSeriesMetadata metadata_;
  std::uint64_t samples_ = 0;
  std::vector<std::string> phases_;  // as they were named last
  std::unique_ptr<Growing> file_;    // null: nothing has been taken yet, or it failed
  std::string fault_;                // not empty: why nothing more is written
};

}  // namespace grapnel
