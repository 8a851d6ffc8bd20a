#pragma once

/// @file
/// Forward dynamics in O(n): the kernel.
///
/// This is the recursion of the Decoupled Natural Orthogonal Complement in articulated-body form: with t = N_l N_d v
/// the equations of motion (B.6) have the mass matrix M = N_d^T N_l^T diag(I_i) N_l N_d = U D U^T (B.8), and the three
/// sweeps below solve U D U^T vdot = tau - h without forming M (docs/theory, section 4; Saha 1997; Featherstone
/// 2008, section 7.3). Everything is expressed in the links' own frames, so a base may be anywhere without loss of
/// accuracy.

#include <limits>
#include <span>

#include "grapnel/dynamics/articulated_inertia.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

/// Per-link scratch of the recursions; nobody but the kernels reads it.
template <class S>
struct LinkScratch {
  SineCosine<S> angle;            // of a revolute joint
  Rotation<S> R_FL;               // of a spherical joint
  Vector3<S> p_PL;                // link origin in the parent's frame
  Twist<S> V;                     // in the link's frame
  SpatialAcceleration<S> bias;    // V x S rate
  ArticulatedInertia<S> I;        // articulated inertia
  bool carries;                   // a child has sent its inertia to I
  Wrench<S> p;                    // articulated bias wrench; in newton_euler: what the joint transmits
  Wrench<S> G;                    // I S / (S^T I S + armature), for one-degree-of-freedom joints
  S g;                            // (force - S^T p) / (S^T I S + armature)
  SpatialAcceleration<S> A;       // gravity counted as an acceleration of the root
  RigidBodyInertia<S> composite;  // of the link and all it carries
  Momentum<S> momentum;           // likewise, about the link's origin
};

/// Scratch of the joints that move by the modes of a chain, (4.14) to (4.16) of docs/theory; nobody but the kernels
/// reads it.
struct ChainScratch {
  std::vector<Wrenchd> U;  // per mode: the wrench at the link under way that its unit acceleration takes; then G
  std::vector<double> D;   // modes x modes: inertia of the modes; then L, D = L L^T, below its diagonal
  std::vector<double> y;   // per mode: bias r; then L^-1 r
  std::vector<double> acceleration;  // per mode
  explicit ChainScratch(const ModalChain& chain)
      : U(static_cast<std::size_t>(chain.modes)), D(U.size() * U.size()), y(U.size()), acceleration(U.size()) {}
};

// As TreeChains.
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

/// What drives a tree. Spans that may be empty mean zero (or nothing prescribed).
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
};

/// Joints that move by the modes of a chain do so for doubles alone; with other scalars they move by themselves, and
/// their velocities are taken to be those that their modes have. A chain is prescribed as a whole or not at all.
///
/// Accelerations vdot of all velocities, and the generalized force at each: as given, or, where the acceleration is
/// prescribed, the force that it takes. All spans have Tree::velocities entries.
template <class S>
void articulated_body(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace,
                      std::span<S> vdot, std::span<S> force);

/// The first two of articulated_body()'s three sweeps: twists, articulated inertias and bias wrenches. Reads everything
/// in `in`; writes the links' scratch but for A.
template <class S>
void articulated_inertias(const Tree<S>& tree, const DynamicsInput<S>& in, DynamicsWorkspace<S>& workspace);

/// The third sweep. In between, whoever wants further forces to act may change what the second sweep left: a force x at
/// a joint with one degree of freedom adds x / (S^T I S + armature) to its g; a wrench on a root, or a moment on a
/// spherical joint, or the force along a prescribed joint, is taken from its p; forces x on the modes of a chain take
/// L^-1 x from its y.
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
