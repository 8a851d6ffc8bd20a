#pragma once

/// @file
/// The model in the form of the recursive kernels: moving links only, in frames such that most joints rotate about a
/// coordinate axis and most joint frames are not rotated relative to their parents.
///
/// Bodies on fixed joints are merged into the link that carries them. A link's internal frame has the same origin as
/// the body's own frame. If the joint's axis is then a coordinate axis, its orientation is the parent's at zero joint
/// angle. Rotating a 6 x 6 articulated inertia by a general matrix takes 240 operations, by one coordinate rotation 60.
/// Thread safety: immutable after construction.

#include <cstdint>
#include <string>
#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

template <class S = double>
struct TreeLink {
  int parent;                   // index of the parent link; -1 for a root
  JointType joint;              // continuous joints are stored as revolute; `free`, `fixed`: roots
  std::uint8_t axis;            // coordinate axis of a revolute or prismatic joint in the link's frame: 0, 1, 2
  bool rotated;                 // X_PF.R is not the identity
  int q;                        // offset of the first coordinate
  int v;                        // offset of the first velocity
  double sign;                  // +1 or -1: sign of the user's axis along the coordinate axis
  Pose<S> X_PF;                 // joint frame in the parent link's frame
  RigidBodyInertia<S> inertia;  // of all bodies merged into the link, about its origin, in its frame
  S armature;                   // reflected rotor inertia
  bool has_armature;            // it is not zero
  /// Spin momentum of the rotor, which the parent carries, per rate along the coordinate axis, in the parent link's
  /// frame.
  Vector3<S> rotor = Vector3<S>::zero();
  bool has_rotor = false;  // it is not zero
  int chain = -1;          // index into Tree::chains for a modal joint
  int member = 0;          // index within the chain
};

/// A chain of modal joints (ModalJoint): the rates of its joints are shapes eta', one eta per mode. The columns of
/// `shapes` are orthonormal and span the columns of the description.
struct ModalChain {
  std::vector<int> links;       // in order from the root, each on the previous one
  std::vector<int> velocities;  // of their joints
  int modes = 0;
  std::vector<double> shapes;  // joints x modes, row-major, for rates as in State::v

  const double* row(int member) const { return &shapes[static_cast<std::size_t>(member * modes)]; }
};

// Only for doubles: translation units of lanes must not emit functions of plain data.
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

/// Errors of modal chains (ModalJoint), one sentence each.
std::vector<std::string> chain_faults(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent);

/// Location of a body in the tree.
struct BodyPlacement {
  int link;    // index into Tree::links
  Posed X_LB;  // the body's frame in the link's internal frame
};

/// Builds the tree of bodies in topological order. `parent[i]` is the index of body i's parent, -1 for none; `q` and
/// `v` are the offsets of each body's joint. Writes `placements`, one per body. Requires that chain_faults() is empty.
Tree<double> make_tree(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent,
                       const std::vector<int>& q, const std::vector<int>& v, std::vector<BodyPlacement>& placements);

/// The same link for another scalar, without modal chains.
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

/// The same tree for another scalar; modal joints become independent in it.
template <class S>
Tree<S> convert_tree(const Tree<double>& tree) {
  Tree<S> result;
  result.coordinates = tree.coordinates;
  result.velocities = tree.velocities;
  for (const TreeLink<double>& link : tree.links) result.links.push_back(convert_link<S>(link));
  return result;
}

}  // namespace grapnel
