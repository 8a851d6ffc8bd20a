// The lane stepper for one lane. Compiled with flags of its own, see CMakeLists.txt.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

void run_lane_phase_one_lane(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<OneLane>>(tables, exchange);
}

}  // namespace grapnel::lanes
