#pragma once

/// @file
/// Detects exchanged end-effectors: whether another assignment of end-effectors to grasps makes all grasp points
/// reachable.

#include <string>
#include <vector>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// Message with the assignment that makes all grasp points reachable, if end-effectors were exchanged in the stated
/// grasps; empty: no exchange helps. For up to four goals all assignments are tried, for more goals all exchanges of
/// two. `faulty`: sets of goals; from each set at least one goal needs another end-effector. `X_WB_end`: final base
/// pose.
std::string exchange_of_grasps(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB_end,
                               const std::vector<std::vector<std::size_t>>& faulty);

}  // namespace grapnel
