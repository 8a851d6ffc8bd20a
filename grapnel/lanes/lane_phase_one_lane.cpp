// The lane stepper for one lane. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

void run_lane_phase_one_lane(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<OneLane>>(tables, exchange);
}

}  // namespace grapnel::lanes
