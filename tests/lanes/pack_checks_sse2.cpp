#include "lanes/make_pack_checks.hpp"

namespace grapnel::lanes::testing {

constinit const PackChecks pack_checks_sse2 = make_pack_checks<Sse2>();

}  // namespace grapnel::lanes::testing
