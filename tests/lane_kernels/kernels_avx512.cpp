#include "lane_kernels/make_kernel_table.hpp"

namespace grapnel::lanes {

constinit const KernelTable kernels_avx512 = make_kernel_table<Avx512>();

}  // namespace grapnel::lanes
