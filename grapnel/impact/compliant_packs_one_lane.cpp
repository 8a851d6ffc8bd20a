// The equations of a compliant impact in packs for one_lane. Compiled with special flags, see CMakeLists.txt.

#include "grapnel/impact/compliant_packs.hpp"

namespace grapnel {

CompliantPacks* make_compliant_packs_one_lane(const CompliantTables& tables, const TreeLink<double>* links, int count) {
  return new PackedPoints<lanes::Pack<lanes::OneLane>>(tables, links, count);
}

}  // namespace grapnel
