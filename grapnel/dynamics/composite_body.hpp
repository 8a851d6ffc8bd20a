#pragma once

/// @file
/// The mass matrix N_d^T N_l^T diag(I_i) N_l N_d (B.8) by composite rigid bodies. The columns that a joint shares with
/// its ancestors follow from the momentum of its subtree (Walker and Orin 1982; Featherstone 2008, table 6.2).

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/spatial/dual.hpp"

namespace grapnel {

/// Fills the symmetric matrix `mass_matrix`, velocities x velocities entries, row-major. Reads in.q only.
template <class S>
void composite_body(const Tree<S>& tree, std::span<const S> q, DynamicsWorkspace<S>& workspace,
                    std::span<S> mass_matrix);

extern template void composite_body<double>(const Tree<double>&, std::span<const double>, DynamicsWorkspace<double>&,
                                            std::span<double>);
extern template void composite_body<Dual>(const Tree<Dual>&, std::span<const Dual>, DynamicsWorkspace<Dual>&,
                                          std::span<Dual>);

}  // namespace grapnel
