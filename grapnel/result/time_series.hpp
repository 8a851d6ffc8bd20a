#pragma once

/// @file
/// Sampled quantities with their names and units, ready to be written.

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
  std::vector<std::string> components;  // width names: "x", "y", "z" or joint names; a scalar: {""} or its own
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

/// Where a time series comes from; written beside it.
struct TimeSeriesMetadata {
  std::string version;  // of Grapnel
  std::string scenario_name;
  std::string scenario_sha256;
};

/// Throws std::invalid_argument, naming the series, unless sizes agree, phases exist, and every path is a unique, plain
/// a/b/c that neither hides `time` or `phase` nor is a group of another series.
void check_time_series(const TimeSeries& series);
/// Sizes and phases alone.
void check_samples(const TimeSeries& series);

/// The block's samples behind those of `series`, which has the same series in the same order.
void append_samples(const TimeSeries& block, TimeSeries& series);

// Where samples go while a run makes them.

/// Whoever wants samples as they come, so that they need not all be kept in memory: a file that grows, say. A run
/// without a sink keeps them in CaptureResult::series.
class SeriesSink {
 public:
  virtual ~SeriesSink() = default;
  /// A block of samples behind those before: all series of the run, every time the same ones. Samples that it takes
  /// out of the block (drop_samples()) are no longer kept by the run; its last block stays in CaptureResult::series.
  virtual void take(TimeSeries& block) = 0;
};

/// Empties a block: names and phases stay, samples go.
void drop_samples(TimeSeries& block);

}  // namespace grapnel
