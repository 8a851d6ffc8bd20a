#pragma once

/// @file
/// Inverse dynamics in O(n): the recursive Newton-Euler kernel, N_d^T N_l^T (M tdot + Omega M t - w) (B.6) evaluated
/// from the tips to the root (Luh, Walker, Paul 1980; Featherstone 2008, table 5.1).

#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel {

/// Generalized forces for the accelerations in `in.acceleration` (empty: zero), minus those of `in.link_wrench` and
/// gravity; `in.force` and `in.prescribed` are not read. With zero acceleration the result is the bias of (2.7), [c_b;
/// c_m]. On return workspace.links[i].p is the wrench that link i's joint transmits to it, in its frame, at its origin.
template <class S>
void newton_euler(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace, std::span<S> force);

extern template void newton_euler<double>(const Tree<double>&, const DynamicsInput<double>&, DynamicsWorkspace<double>&,
                                          std::span<double>);

}  // namespace grapnel
