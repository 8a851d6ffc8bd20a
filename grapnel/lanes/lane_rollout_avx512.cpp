// The lane rollouts for avx512. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_rollout.hpp"

namespace grapnel::lanes {

void run_lane_rollout_avx512(const RolloutTables& tables, const RolloutCases& cases) {
  run_lane_rollout<Pack<Avx512>>(tables, cases);
}

}  // namespace grapnel::lanes
