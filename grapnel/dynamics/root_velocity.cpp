#include "grapnel/dynamics/root_velocity_kernel.hpp"

namespace grapnel {

template void recover_roots<double>(const Tree<double>&, std::span<const RootMomentum<double>>, const double&,
                                    DynamicsWorkspace<double>&, std::span<double>, std::span<double>);
template void root_momenta<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                   DynamicsWorkspace<double>&, std::span<RootMomentum<double>>);

}  // namespace grapnel
