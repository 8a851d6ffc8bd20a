// The lane rollouts for one_lane. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_rollout.hpp"

namespace grapnel::lanes {

void run_lane_rollout_one_lane(const RolloutTables& tables, const RolloutCases& cases) {
  run_lane_rollout<Pack<OneLane>>(tables, cases);
}

}  // namespace grapnel::lanes
