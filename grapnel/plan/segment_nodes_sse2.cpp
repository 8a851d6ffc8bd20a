// The nodes of a path segment in packs for sse2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/plan/segment_node_packs.hpp"

namespace grapnel {

SegmentNodes* make_segment_nodes_sse2(const NodeTables& tables) {
  return new PackedNodes<lanes::Pack<lanes::Rounded<lanes::Sse2>>>(tables);
}

}  // namespace grapnel
