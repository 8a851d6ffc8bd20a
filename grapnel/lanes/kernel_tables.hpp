#pragma once

/// @file
/// The tables that the instruction sets' translation units define. Reading one is possible anywhere, calling its
/// functions only where dispatch.hpp says that the set is supported. Thread safety: constants.

#include "grapnel/lanes/kernel_table.hpp"

namespace grapnel::lanes {

extern const KernelTable kernels_one_lane;
extern const KernelTable kernels_sse2;
extern const KernelTable kernels_avx2;
extern const KernelTable kernels_avx512;

}  // namespace grapnel::lanes
