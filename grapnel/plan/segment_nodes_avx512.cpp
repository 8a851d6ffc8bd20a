// The nodes of a path segment in packs for avx512. Compiled with set-specific flags, see CMakeLists.txt.

#include "grapnel/plan/segment_node_packs.hpp"

namespace grapnel {

SegmentNodes* make_segment_nodes_avx512(const NodeTables& tables) {
  return new PackedNodes<lanes::Pack<lanes::Rounded<lanes::Avx512>>>(tables);
}

}  // namespace grapnel
