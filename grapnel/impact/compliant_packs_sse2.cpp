// The equations of a compliant impact in packs for sse2. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/compliant_packs.hpp"

namespace grapnel {

CompliantPacks* make_compliant_packs_sse2(const CompliantTables& tables, const TreeLink<double>* links, int count) {
  return new PackedPoints<lanes::Pack<lanes::Sse2>>(tables, links, count);
}

}  // namespace grapnel
