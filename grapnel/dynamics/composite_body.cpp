#include "grapnel/dynamics/composite_body_kernel.hpp"

namespace grapnel {

template void composite_body<double>(const Tree<double>&, std::span<const double>, DynamicsWorkspace<double>&,
                                     std::span<double>);
template void composite_body<Dual>(const Tree<Dual>&, std::span<const Dual>, DynamicsWorkspace<Dual>&, std::span<Dual>);

}  // namespace grapnel
