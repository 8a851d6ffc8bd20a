// States in lanes for one instruction set, GRAPNEL_LANE_SET. Compiled once per set (cmake/GrapnelLanes.cmake).

#include "grapnel/lanes/lane_states.hpp"

namespace grapnel::lanes {

template <class Set>
void run_lane_states_of(const StatesTables& tables, const StateCases& cases) {
  run_lane_states<Pack<Set>>(tables, cases);
}

template void run_lane_states_of<GRAPNEL_LANE_SET>(const StatesTables&, const StateCases&);

}  // namespace grapnel::lanes
