// Rollouts in lanes for one instruction set, GRAPNEL_LANE_SET. Compiled once per set (cmake/GrapnelLanes.cmake).

#include "grapnel/lanes/lane_rollout.hpp"

namespace grapnel::lanes {

template <class Set>
void run_lane_rollout_of(const RolloutTables& tables, const RolloutCases& cases) {
  run_lane_rollout<Pack<Set>>(tables, cases);
}

template void run_lane_rollout_of<GRAPNEL_LANE_SET>(const RolloutTables&, const RolloutCases&);

}  // namespace grapnel::lanes
