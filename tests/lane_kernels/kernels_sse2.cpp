#include "lane_kernels/make_kernel_table.hpp"

namespace grapnel::lanes {

constinit const KernelTable kernels_sse2 = make_kernel_table<Sse2>();

}  // namespace grapnel::lanes
