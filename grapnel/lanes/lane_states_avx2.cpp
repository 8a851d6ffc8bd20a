// The states in lanes for avx2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_states.hpp"

namespace grapnel::lanes {

void run_lane_states_avx2(const StatesTables& tables, const StateCases& cases) {
  run_lane_states<Pack<Avx2>>(tables, cases);
}

}  // namespace grapnel::lanes
