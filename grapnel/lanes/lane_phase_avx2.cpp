// The lane stepper for AVX2 and FMA. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

void run_lane_phase_avx2(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<Avx2>>(tables, exchange);
}

}  // namespace grapnel::lanes
