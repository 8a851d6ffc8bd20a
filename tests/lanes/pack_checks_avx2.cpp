#include "lanes/make_pack_checks.hpp"

namespace grapnel::lanes::testing {

constinit const PackChecks pack_checks_avx2 = make_pack_checks<Avx2>();

}  // namespace grapnel::lanes::testing
