#pragma once

/// @file
/// Where samples go while a run makes them.

#include "grapnel/result/time_series.hpp"

namespace grapnel {

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
