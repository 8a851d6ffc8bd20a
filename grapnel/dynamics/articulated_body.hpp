#pragma once

/// @file
/// Forward dynamics in O(n): the articulated-body kernel.
///
/// This is the recursion of the Decoupled Natural Orthogonal Complement in articulated-body form. With t = N_l N_d v
/// the equations of motion (B.6) have the mass matrix M = N_d^T N_l^T diag(I_i) N_l N_d = U D U^T (B.8). The three
/// sweeps below solve U D U^T vdot = tau - h without forming M (docs/theory, section 4; Saha 1997; Featherstone
/// 2008, section 7.3). All quantities are expressed in the links' own frames; accuracy is therefore independent of the
/// base position.

#include <limits>
#include <span>

#include "grapnel/dynamics/articulated_inertia.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

/// Per-link scratch of the recursions; private to the kernels.
template <class S>
struct LinkScratch {
  SineCosine<S> angle;            // of a revolute joint
  Rotation<S> R_FL;               // of a spherical joint
  Vector3<S> p_PL;                // link origin in the parent's frame
  Twist<S> V;                     // in the link's frame
  SpatialAcceleration<S> bias;    // V x S rate
  ArticulatedInertia<S> I;        // articulated inertia
  bool carries;                   // a child has added its inertia to I
  Wrench<S> p;                    // articulated bias wrench; in newton_euler: the wrench that the joint transmits
  Wrench<S> G;                    // I S / (S^T I S + armature), for one-degree-of-freedom joints
  S g;                            // (force - S^T p) / (S^T I S + armature)
  SpatialAcceleration<S> A;       // gravity counted as an acceleration of the root
  RigidBodyInertia<S> composite;  // of the link and its subtree
  Momentum<S> momentum;           // likewise, about the link's origin
};

/// Scratch of modal joints, (4.14) to (4.16) of docs/theory; private to the kernels.
struct ChainScratch {
  std::vector<Wrenchd> U;            // per mode: the wrench at the current link per unit modal acceleration; then G
  std::vector<double> D;             // modes x modes: inertia of the modes; then L, D = L L^T, below its diagonal
  std::vector<double> y;             // per mode: bias r; then L^-1 r
  std::vector<double> acceleration;  // per mode
  explicit ChainScratch(const ModalChain& chain)
      : U(static_cast<std::size_t>(chain.modes)), D(U.size() * U.size()), y(U.size()), acceleration(U.size()) {}
};

// Same layout as TreeChains.
template <class S>
struct ChainScratches {
  ChainScratches() = default;
  explicit ChainScratches(const Tree<S>&) {}
};
template <>
struct ChainScratches<double> {
  std::vector<ChainScratch> chains;
  ChainScratches() = default;
  explicit ChainScratches(const Tree<double>& tree) : chains(tree.chains.begin(), tree.chains.end()) {}
};

template <class S>
struct DynamicsWorkspace : ChainScratches<S> {
  std::vector<LinkScratch<S>> links;
  DynamicsWorkspace() = default;
  explicit DynamicsWorkspace(const Tree<S>& tree) : ChainScratches<S>(tree), links(tree.links.size()) {}
};

/// Input of the recursions. Optional spans may be empty: zero (or no prescribed acceleration).
template <class S>
struct DynamicsInput {
  std::span<const S> q;      // coordinates
  std::span<const S> v;      // velocities
  std::span<const S> force;  // generalized forces [N m, N]; a free root: the wrench on B, in B, at B's origin
  std::span<const Wrench<S>> link_wrench;  // external wrench on each link, in its frame, at its origin; may be empty
  std::span<const std::uint8_t>
      prescribed;                   // per velocity: its acceleration is given instead of its force; may be empty
  std::span<const S> acceleration;  // the given accelerations, read where prescribed; may be empty
  Vector3<S> gravity = Vector3<S>::zero();  // in W [m/s^2]
  bool placed = false;  // whether the workspace has the joint transforms of these coordinates, as after recover_roots()
};

/// Output of the recursions: accelerations of all velocities, and the generalized force at each, the given one or, for
/// a prescribed acceleration, the required one.
template <class S>
struct DynamicsOutput {
  std::span<S> vdot, force;
};

/// Computes accelerations and generalized forces as in DynamicsOutput. All spans have Tree::velocities entries.
///
/// Modal joints are supported for doubles only; other scalars treat their joints as independent, with velocities that
/// must be consistent with the modes. A chain is prescribed as a whole or not at all.
template <class S>
void articulated_body(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                      std::span<S> vdot, std::span<S> force);

/// The first two of articulated_body()'s three sweeps: twists, articulated inertias and bias wrenches. Reads all of
/// `in`; writes the links' scratch except A.
template <class S>
void articulated_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace);

/// The third sweep: accelerations. To apply further forces, modify the results of the second sweep before this call.
/// Add x / (S^T I S + armature) to g for a force x at a joint with one degree of freedom. Subtract from p a wrench on a
/// root, a moment on a spherical joint, or a force along a prescribed joint. Subtract L^-1 x from y for forces x on the
/// modes of a chain.
template <class S>
void articulated_accelerations(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                               std::span<S> vdot, std::span<S> force);

extern template void articulated_inertias<double>(const Tree<double>&, const DynamicsInput<double>&,
                                                  DynamicsWorkspace<double>&);
extern template void articulated_accelerations<double>(const Tree<double>&, const DynamicsInput<double>&,
                                                       DynamicsWorkspace<double>&, std::span<double>,
                                                       std::span<double>);
extern template void articulated_body<double>(const Tree<double>&, const DynamicsInput<double>&,
                                              DynamicsWorkspace<double>&, std::span<double>, std::span<double>);

}  // namespace grapnel
