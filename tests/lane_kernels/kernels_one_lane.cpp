#include "lane_kernels/make_kernel_table.hpp"

namespace grapnel::lanes {

constinit const KernelTable kernels_one_lane = make_kernel_table<OneLane>();

}  // namespace grapnel::lanes
