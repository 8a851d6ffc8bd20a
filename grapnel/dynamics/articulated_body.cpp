#include "grapnel/dynamics/articulated_body_kernel.hpp"

namespace grapnel {

template void articulated_inertias<double>(const Tree<double>&, const DynamicsInput<double>&,
                                           DynamicsWorkspace<double>&);
template void articulated_accelerations<double>(const Tree<double>&, const DynamicsInput<double>&,
                                                DynamicsWorkspace<double>&, std::span<double>, std::span<double>);
template void articulated_body<double>(const Tree<double>&, const DynamicsInput<double>&, DynamicsWorkspace<double>&,
                                       std::span<double>, std::span<double>);

}  // namespace grapnel
