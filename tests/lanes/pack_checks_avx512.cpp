#include "lanes/make_pack_checks.hpp"

namespace grapnel::lanes::testing {

constinit const PackChecks pack_checks_avx512 = make_pack_checks<Avx512>();

}  // namespace grapnel::lanes::testing
