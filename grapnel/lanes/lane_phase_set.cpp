// The lane stepper for one instruction set, GRAPNEL_LANE_SET. Compiled once per set (cmake/GrapnelLanes.cmake).

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

template <class Set>
void run_lane_phase_of(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<Set>>(tables, exchange);
}

template void run_lane_phase_of<GRAPNEL_LANE_SET>(const PhaseTables&, CaseExchange&);

}  // namespace grapnel::lanes
