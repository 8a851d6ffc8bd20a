#include "lanes/make_pack_checks.hpp"

namespace grapnel::lanes::testing {

constinit const PackChecks pack_checks_one_lane = make_pack_checks<OneLane>();

}  // namespace grapnel::lanes::testing
