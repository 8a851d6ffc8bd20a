#pragma once

/// @file
/// Robots whose arms are welded to each other at their ends, for the benchmarks of closed loops.

#include "bench/workload.hpp"
#include "grapnel/constraint/loop_closure.hpp"

namespace grapnel::bench {

/// The states of `base` satisfy the closures in position and velocity; the velocities in `open` do not.
struct LoopWorkload {
  Workload base;
  std::vector<LoopClosure> closures;
  std::vector<std::vector<double>> open;  // per state
};

/// The robot of make_workload() with the end of each arm but the last welded to that of the next: arms - 1 loops.
LoopWorkload make_loops(const std::string& name, int arms, int joints, bool alternate);

/// (a) and (b) with one loop.
std::vector<LoopWorkload> loop_targets();
/// One loop of 2 x 14 to 2 x 56 joints; two loops of 3 x 7, three of 4 x 7 joints.
std::vector<LoopWorkload> more_loops();

}  // namespace grapnel::bench
