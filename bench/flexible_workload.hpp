#pragma once

/// @file
/// Robots whose links bend, cut into pieces in two ways: as Grapnel does, at the Gauss points of segments, and as
/// engines without beams are used, in the middles of segments. Both with as few pieces as keep the frequencies of so
/// many modes of a clamped link within one percent.

#include "bench/workload.hpp"

namespace grapnel::bench {

enum class Cut { gauss, middles };

struct FlexibleWorkload {
  Workload workload;
  int hinges = 0;    // in a link
  double error = 0;  // largest relative error of the modes' frequencies

  std::string description() const;
};

/// "a" with three modes a link and "b" with two, of links that bend in the plane in which their joints turn.
std::vector<FlexibleWorkload> flexible_targets(Cut cut);

}  // namespace grapnel::bench
