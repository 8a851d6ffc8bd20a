#pragma once

/// @file
/// Robots with flexible links, divided into rigid segments in two ways: at the Gauss points of beam segments, as in
/// Grapnel, and at the middles of segments, as for engines without beams. Both use the minimum number of segments that
/// keeps the frequencies of the stated number of modes of a clamped link within one percent.

#include "bench/workload.hpp"

namespace grapnel::bench {

enum class Cut { gauss, middles };

struct FlexibleWorkload {
  Workload workload;
  int hinges = 0;    // per link
  double error = 0;  // largest relative error of the modes' frequencies

  std::string description() const;
};

/// "a" with three modes per link and "b" with two; the links bend in the plane of rotation of their joints.
std::vector<FlexibleWorkload> flexible_targets(Cut cut);

}  // namespace grapnel::bench
