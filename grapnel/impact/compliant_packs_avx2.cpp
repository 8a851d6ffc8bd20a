// The equations of a compliant impact in packs for avx2. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/compliant_packs.hpp"

namespace grapnel {

CompliantPacks* make_compliant_packs_avx2(const CompliantTables& tables, const TreeLink<double>* links, int count) {
  return new PackedPoints<lanes::Pack<lanes::Avx2>>(tables, links, count);
}

}  // namespace grapnel
