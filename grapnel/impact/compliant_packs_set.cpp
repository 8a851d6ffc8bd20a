// The equations of a compliant impact in packs for one instruction set, GRAPNEL_LANE_SET. Compiled once per set
// (cmake/GrapnelLanes.cmake).

#include "grapnel/impact/compliant_packs.hpp"

namespace grapnel {

template <class Set>
CompliantPacks* make_compliant_packs_of(const CompliantTables& tables, const TreeLink<double>* links, int count) {
  return new PackedPoints<lanes::Pack<Set>>(tables, links, count);
}

template CompliantPacks* make_compliant_packs_of<lanes::GRAPNEL_LANE_SET>(const CompliantTables&,
                                                                          const TreeLink<double>*, int);

}  // namespace grapnel
