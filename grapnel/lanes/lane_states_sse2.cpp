// The states in lanes for sse2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_states.hpp"

namespace grapnel::lanes {

void run_lane_states_sse2(const StatesTables& tables, const StateCases& cases) {
  run_lane_states<Pack<Sse2>>(tables, cases);
}

}  // namespace grapnel::lanes
