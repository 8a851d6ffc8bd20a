#include "grapnel/dynamics/newton_euler_kernel.hpp"

namespace grapnel {

template void newton_euler<double>(const Tree<double>&, const DynamicsInput<double>&, DynamicsWorkspace<double>&,
                                   std::span<double>);

}  // namespace grapnel
