#pragma once

/// @file
/// Grasps whose end-effectors are exchanged: whether another assignment makes all places reachable.

#include <string>
#include <vector>

#include "grapnel/plan/reach.hpp"

namespace grapnel {

/// Whether the stated grasps fail because end-effectors are exchanged, in words: who is to be where instead; empty: no
/// exchange makes all arrive. Of up to four goals all assignments are tried, of more those that exchange two. `faulty`:
/// sets of goals of each of which at least one has to go to another end-effector. `X_WB_end`: where the base ends.
std::string exchange_of_grasps(FloatingBase& base, const ReachProblem& problem, const Posed& X_WB_end,
                               const std::vector<std::vector<std::size_t>>& faulty);

}  // namespace grapnel
