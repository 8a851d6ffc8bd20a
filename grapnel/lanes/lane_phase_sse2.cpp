// The lane stepper for SSE2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

void run_lane_phase_sse2(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<Sse2>>(tables, exchange);
}

}  // namespace grapnel::lanes
