// The nodes of a path segment in packs for one_lane. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/plan/segment_node_packs.hpp"

namespace grapnel {

SegmentNodes* make_segment_nodes_one_lane(const NodeTables& tables) {
  return new PackedNodes<lanes::Pack<lanes::Rounded<lanes::OneLane>>>(tables);
}

}  // namespace grapnel
