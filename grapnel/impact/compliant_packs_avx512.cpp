// The equations of a compliant impact in packs for avx512. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/compliant_packs.hpp"

namespace grapnel {

CompliantPacks* make_compliant_packs_avx512(const CompliantTables& tables, const TreeLink<double>* links, int count) {
  return new PackedPoints<lanes::Pack<lanes::Avx512>>(tables, links, count);
}

}  // namespace grapnel
