#pragma once

/// @file
/// Motion of free roots from the conserved quantities of their trees: (2.3) and (2.6) as an O(n) kernel.
///
/// Without external loads, a tree's momentum is constant and its centre of mass moves uniformly. The base's twist is
/// V_B = I_c^-1 (h_B - h_joints), with I_c the composite inertia and h_joints the momentum of the joint rates alone;
/// its position follows from the centre of mass and the pose. Computed in this manner instead of by integration,
/// momenta cannot drift.

#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel {

/// The conserved quantities of a free tree.
template <class S>
struct RootMomentum {
  Momentum<S> h;      // [angular about the tree's own centre of mass; linear], in W
  Vector3<S> p_WCom;  // centre of mass in W at the time the momentum was taken [m]
  S mass;             // [kg]
};

/// Overwrites the velocities in `v` and the positions in `q` of all free roots (in the order of the links), such that
/// each tree has its conserved momentum, and its centre of mass has its position `elapsed` [s] after the momentum was
/// stored.
template <class S>
void recover_roots(const Tree<S>& tree, std::span<const RootMomentum<S>> momentum, const S& elapsed,
                   DynamicsWorkspace<S>& workspace, std::span<S> q, std::span<S> v);

/// The conserved quantities of the trees of all free roots in this state.
template <class S>
void root_momenta(const Tree<S>& tree, std::span<const S> q, std::span<const S> v, DynamicsWorkspace<S>& workspace,
                  std::span<RootMomentum<S>> momentum);

/// Number of free roots.
template <class S>
int free_root_count(const Tree<S>& tree) {
  int count = 0;
  for (const TreeLink<S>& link : tree.links) count += link.joint == JointType::free;
  return count;
}

extern template void recover_roots<double>(const Tree<double>&, std::span<const RootMomentum<double>>, const double&,
                                           DynamicsWorkspace<double>&, std::span<double>, std::span<double>);
extern template void root_momenta<double>(const Tree<double>&, std::span<const double>, std::span<const double>,
                                          DynamicsWorkspace<double>&, std::span<RootMomentum<double>>);

}  // namespace grapnel
