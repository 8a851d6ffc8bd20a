#include "lane_kernels/kernel_table.hpp"

namespace grapnel::lanes {

const KernelTable& kernels(InstructionSet set) {
  return *of_set(set, []<class Set>(std::type_identity<Set>) { return &kernels_of<Set>(); });
}

}  // namespace grapnel::lanes
