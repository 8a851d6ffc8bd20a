#pragma once

/// @file
/// Velocities of free roots from the momenta of their trees: (2.3) and (2.6) as an O(n) kernel.
///
/// Where nothing acts from outside, a tree's momentum is a constant of the motion, and the base's twist is what
/// momentum and joint rates leave: V_B = I_c^-1 (h_B - h_joints), I_c the composite inertia and h_joints the momentum
/// of the joint rates alone. Taken from there instead of from its own differential equation, momentum cannot drift.
/// Thread safety: reads the tree, writes only the workspace and the outputs.

#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel {

/// Overwrites the root velocities in `v` so that the tree of each free root (in the order of the links) has the
/// momentum in `momentum`: [angular about the tree's own centre of mass; linear], in W.
template <class S>
void recover_root_velocities(const Tree<S>& tree, std::span<const S> q, std::span<const Momentum<S>> momentum,
                             DynamicsWorkspace<S>& workspace, std::span<S> v);

/// The momenta that velocities `v` give, in the same form: one per free root.
template <class S>
void root_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, DynamicsWorkspace<S>& workspace,
                  std::span<Momentum<S>> momentum);

/// Number of free roots.
template <class S>
int free_root_count(const Tree<S>& tree) {
  int count = 0;
  for (const TreeLink<S>& link : tree.links) count += link.joint == LinkJoint::root_free;
  return count;
}

extern template void recover_root_velocities<double>(const Tree<double>&, std::span<const double>,
                                                     std::span<const Momentum<double>>, DynamicsWorkspace<double>&,
                                                     std::span<double>);
extern template void root_momenta<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                          DynamicsWorkspace<double>&, std::span<Momentum<double>>);

}  // namespace grapnel
