// The nodes of a path segment in packs for avx2. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/plan/segment_node_packs.hpp"

namespace grapnel {

SegmentNodes* make_segment_nodes_avx2(const NodeTables& tables) {
  return new PackedNodes<lanes::Pack<lanes::Rounded<lanes::Avx2>>>(tables);
}

}  // namespace grapnel
