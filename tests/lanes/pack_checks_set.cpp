// The checks of Pack for one instruction set, GRAPNEL_LANE_SET. Compiled once per set (cmake/GrapnelLanes.cmake).

#include "lanes/make_pack_checks.hpp"

namespace grapnel::lanes::testing {

template <class Set>
const PackChecks& pack_checks_of() {
  static constinit const PackChecks checks = make_pack_checks<Set>();
  return checks;
}

template const PackChecks& pack_checks_of<GRAPNEL_LANE_SET>();

}  // namespace grapnel::lanes::testing
