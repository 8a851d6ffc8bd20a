// The lane rollouts for sse2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_rollout.hpp"

namespace grapnel::lanes {

void run_lane_rollout_sse2(const RolloutTables& tables, const RolloutCases& cases) {
  run_lane_rollout<Pack<Sse2>>(tables, cases);
}

}  // namespace grapnel::lanes
