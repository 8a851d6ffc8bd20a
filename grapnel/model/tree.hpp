#pragma once

/// @file
/// The form in which the recursive kernels see a model: moving links only, in frames chosen so that most joints turn
/// about a coordinate axis and most joint frames are not rotated against their parents.
///
/// Bodies on fixed joints are merged into the link that carries them. A link's internal frame has the same origin as
/// the body's own frame; its orientation is the parent's at zero joint angle whenever the joint's axis is then a
/// coordinate axis. Rotating a 6 x 6 articulated inertia by a general matrix is 240 operations, by one coordinate
/// rotation 60. Thread safety: immutable after construction.

#include <cstdint>
#include <string>
#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

template <class S = double>
struct TreeLink {
  int parent;                   // index of the parent link; -1 for a root
  JointType joint;              // a continuous joint moves as a revolute one and is one here; `free`, `fixed`: of roots
  std::uint8_t axis;            // coordinate axis of a revolute or prismatic joint in the link's frame: 0, 1, 2
  bool rotated;                 // X_PF.R is not the identity
  int q;                        // first coordinate
  int v;                        // first velocity
  double sign;                  // +1 or -1: whether the user's axis points along the coordinate axis
  Pose<S> X_PF;                 // joint frame in the parent link's frame
  RigidBodyInertia<S> inertia;  // of all bodies merged into the link, about its origin, in its frame
  S armature;                   // reflected rotor inertia
  bool has_armature;            // it is not zero
  /// Spin momentum of the rotor that the parent carries, per rate along the coordinate axis, in the parent link's
  /// frame.
  Vector3<S> rotor = Vector3<S>::zero();
  bool has_rotor = false;  // it is not zero
  int chain = -1;          // index into Tree::chains, if the joint moves by the modes of one
  int member = 0;          // its place in it
};

/// Joints that move by a few modes (ModalJoint): the rates of the chain's joints are shapes eta', with as many eta as
/// there are modes. The columns of `shapes` are orthonormal; they span what the columns of the description do.
struct ModalChain {
  std::vector<int> links;       // from the inside out, each on the one before it
  std::vector<int> velocities;  // of their joints
  int modes = 0;
  std::vector<double> shapes;  // joints x modes, row by row, of rates as State::v has them

  const double* row(int member) const { return &shapes[static_cast<std::size_t>(member * modes)]; }
};

// Only doubles have them: translation units of lanes must not emit functions of plain data.
template <class S>
struct TreeChains {};
template <>
struct TreeChains<double> {
  std::vector<ModalChain> chains;
};

template <class S = double>
struct Tree : TreeChains<S> {
  std::vector<TreeLink<S>> links;  // parents before children
  int coordinates = 0;
  int velocities = 0;
};

/// What is wrong with the chains of joints that move by modes (ModalJoint): a sentence a fault.
std::vector<std::string> chain_faults(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent);

/// Where a body sits in the tree.
struct BodyPlacement {
  int link;    // index into Tree::links
  Posed X_LB;  // the body's frame in the link's internal frame
};

/// Builds the tree of bodies listed parents before children. `parent[i]` is the index of body i's parent, -1 for none;
/// `q` and `v` are the offsets of each body's joint. Fills `placements`, one per body. chain_faults() finds nothing.
Tree<double> make_tree(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent,
                       const std::vector<int>& q, const std::vector<int>& v, std::vector<BodyPlacement>& placements);

/// The same link with another scalar, moving by itself.
template <class S>
TreeLink<S> convert_link(const TreeLink<double>& l) {
  TreeLink<S> t{l.parent, l.joint, l.axis,        l.rotated,      l.q, l.v,  l.sign,
                {},       {},      S(l.armature), l.has_armature, {},  false};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.X_PF.R.m[i][j] = S(l.X_PF.R.m[i][j]);
    t.X_PF.p[i] = S(l.X_PF.p[i]);
    t.inertia.first_moment[i] = S(l.inertia.first_moment[i]);
    t.rotor[i] = S(l.rotor[i]);
  }
  t.has_rotor = l.has_rotor;
  t.inertia.mass = S(l.inertia.mass);
  const Symmetric3<double>& J = l.inertia.rotational;
  t.inertia.rotational = {S(J.xx), S(J.yy), S(J.zz), S(J.xy), S(J.xz), S(J.yz)};
  return t;
}

/// The same tree with another scalar; joints of chains move by themselves in it.
template <class S>
Tree<S> convert_tree(const Tree<double>& tree) {
  Tree<S> result;
  result.coordinates = tree.coordinates;
  result.velocities = tree.velocities;
  for (const TreeLink<double>& link : tree.links) result.links.push_back(convert_link<S>(link));
  return result;
}

}  // namespace grapnel
