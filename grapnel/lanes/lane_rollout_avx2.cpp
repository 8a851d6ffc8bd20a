// The lane rollouts for avx2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_rollout.hpp"

namespace grapnel::lanes {

void run_lane_rollout_avx2(const RolloutTables& tables, const RolloutCases& cases) {
  run_lane_rollout<Pack<Avx2>>(tables, cases);
}

}  // namespace grapnel::lanes
