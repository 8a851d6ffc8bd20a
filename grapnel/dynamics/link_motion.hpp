#pragma once

/// @file
/// Poses and twists of the links in the world (forward kinematics), the kernel behind kinematics.hpp.

#include <span>

#include "grapnel/spatial/dual.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

template <class S>
struct Tree;

template <class S>
struct LinkMotion {
  Pose<S> X_WL;
  Twist<S> V_WL;  // at the link's origin, in W
};

/// One entry per link of the tree. With v empty, twists are zero.
template <class S>
void link_motion(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, std::span<LinkMotion<S>> motion);

extern template void link_motion<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                         std::span<LinkMotion<double>>);
extern template void link_motion<Dual>(const Tree<Dual>&, std::span<const Dual>, std::span<const Dual>,
                                       std::span<LinkMotion<Dual>>);

}  // namespace grapnel
