// The states in lanes for one_lane. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_states.hpp"

namespace grapnel::lanes {

void run_lane_states_one_lane(const StatesTables& tables, const StateCases& cases) {
  run_lane_states<Pack<OneLane>>(tables, cases);
}

}  // namespace grapnel::lanes
