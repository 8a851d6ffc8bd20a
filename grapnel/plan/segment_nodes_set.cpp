// The nodes of a path segment in packs for one instruction set, GRAPNEL_LANE_SET. Compiled once per set
// (cmake/GrapnelLanes.cmake).

#include "grapnel/plan/segment_node_packs.hpp"

namespace grapnel {

template <class Set>
SegmentNodes* make_segment_nodes_of(const NodeTables& tables) {
  return new PackedNodes<lanes::Pack<lanes::Rounded<Set>>>(tables);
}

template SegmentNodes* make_segment_nodes_of<lanes::GRAPNEL_LANE_SET>(const NodeTables&);

}  // namespace grapnel
