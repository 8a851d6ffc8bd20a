#include "lane_kernels/kernel_table.hpp"

namespace grapnel::lanes {

const KernelTable& kernels([[maybe_unused]] InstructionSet set) {
#ifdef GRAPNEL_LANES_X86
  switch (set) {
    case InstructionSet::sse2:
      return kernels_sse2;
    case InstructionSet::avx2:
      return kernels_avx2;
    case InstructionSet::avx512:
      return kernels_avx512;
    default:
      break;
  }
#endif
  return kernels_one_lane;
}

}  // namespace grapnel::lanes
