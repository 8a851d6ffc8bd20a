// The lane stepper for AVX-512. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/lanes/lane_stepper.hpp"

namespace grapnel::lanes {

void run_lane_phase_avx512(const PhaseTables& tables, CaseExchange& exchange) {
  run_lane_phase<Pack<Avx512>>(tables, exchange);
}

}  // namespace grapnel::lanes
