#include "lane_kernels/make_kernel_table.hpp"

namespace grapnel::lanes {

constinit const KernelTable kernels_avx2 = make_kernel_table<Avx2>();

}  // namespace grapnel::lanes
