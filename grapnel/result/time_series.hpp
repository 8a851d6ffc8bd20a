#pragma once

/// @file
/// Sampled quantities with their names and units.

#include <string>
#include <vector>

namespace grapnel {

/// Name and version of the format of timeseries.h5, and of the .mat files made from it.
inline constexpr const char* kTimeSeriesSchema = "grapnel-timeseries/1";

/// One quantity over time: `data` holds width numbers per sample, sample after sample.
struct Series {
  std::string path;  // "base/position": group and dataset in HDF5
  std::string unit;  // "m"; "1" for none
  std::string description;
  std::vector<std::string> components;  // width names: "x", "y", "z" or joint names; a scalar: {""} or its name
  std::vector<double> data;
  int width() const { return static_cast<int>(components.size()); }
};

/// Samples at common times. The phase "contact" holds two samples of one time, just before and just after the impact.
struct TimeSeries {
  std::vector<double> time;         // [s]
  std::vector<int> phase;           // index into phases
  std::vector<std::string> phases;  // "approach", "post_impact"
  std::vector<Series> series;
};

/// Origin of a time series, stored with it.
struct TimeSeriesMetadata {
  std::string version;  // of Grapnel
  std::string scenario_name;
  std::string scenario_sha256;
};

/// Throws std::invalid_argument, naming the series, unless sizes agree, phases exist, and every path is a unique, plain
/// a/b/c that neither hides `time` or `phase` nor is a group of another series.
void check_time_series(const TimeSeries& series);
/// Checks only sizes and phases.
void check_samples(const TimeSeries& series);

/// Appends the block's samples to `series`, which has the same series in the same order.
void append_samples(const TimeSeries& block, TimeSeries& series);

// Sinks for samples during a run.

/// Receives samples during the run, for example to write a file block by block. A run without a sink keeps them in
/// CaptureResult::series.
class SeriesSink {
 public:
  virtual ~SeriesSink() = default;
  /// Receives the next block of samples: all series of the run, the same in every block. The run does not keep samples
  /// that the sink removes from the block (drop_samples()); the last block stays in CaptureResult::series.
  virtual void take(TimeSeries& block) = 0;
  /// Called after each sample, with the samples since the last block was taken.
  virtual void sampled(const TimeSeries& /*block*/) {}
};

/// Removes the samples of a block; names and phases remain.
void drop_samples(TimeSeries& block);

}  // namespace grapnel
