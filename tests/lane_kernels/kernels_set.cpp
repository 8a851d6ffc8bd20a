// The recursive kernels for one instruction set, GRAPNEL_LANE_SET. Compiled once per set (cmake/GrapnelLanes.cmake).

#include "lane_kernels/make_kernel_table.hpp"

namespace grapnel::lanes {

template <class Set>
const KernelTable& kernels_of() {
  static constinit const KernelTable table = make_kernel_table<Set>();
  return table;
}

template const KernelTable& kernels_of<GRAPNEL_LANE_SET>();

}  // namespace grapnel::lanes
