#include "grapnel/dynamics/link_motion_kernel.hpp"

namespace grapnel {

template void link_motion<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                  std::span<LinkMotion<double>>);
template void link_motion<Dual>(const Tree<Dual>&, std::span<const Dual>, std::span<const Dual>,
                                std::span<LinkMotion<Dual>>);

}  // namespace grapnel
