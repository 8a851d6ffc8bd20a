#pragma once

/// @file
/// Joint operations of the recursive kernels: propagation of motion from parent to link, transformation of inertias and
/// wrenches to the parent, and elimination of the joint's degrees of freedom. One overload per kind of joint, selected
/// once per link by `visit_joint`; sweeps and lanes are independent of the kinds.

#include <algorithm>
#include <cmath>
#include <span>

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/symmetric_solve.hpp"

namespace grapnel::recursion {

/// A revolute joint about coordinate axis K of the link's frame.
template <int K>
struct Revolute {
  static constexpr int kVelocities = 1;
  static constexpr bool kTurns = true;
  static constexpr int kAxis = K;
};
/// A prismatic joint along coordinate axis K.
template <int K>
struct Prismatic {
  static constexpr int kVelocities = 1;
  static constexpr bool kTurns = false;
  static constexpr int kAxis = K;
};
struct Spherical {
  static constexpr int kVelocities = 3;
};
struct Root {};
template <class Joint>
inline constexpr bool kIsRoot = std::is_same_v<Joint, Root>;
template <class Joint>
concept OneAxis = Joint::kVelocities == 1;

/// Calls f with the tag of the link's joint.
template <class S, class F>
GRAPNEL_INLINE void visit_joint(const TreeLink<S>& link, F&& f) {
  if (link.joint == JointType::revolute) [[likely]] {
    switch (link.axis) {
      case 0:
        f(Revolute<0>{});
        return;
      case 1:
        f(Revolute<1>{});
        return;
      default:
        f(Revolute<2>{});
        return;
    }
  }
  switch (link.joint) {
    case JointType::prismatic:
      switch (link.axis) {
        case 0:
          f(Prismatic<0>{});
          return;
        case 1:
          f(Prismatic<1>{});
          return;
        default:
          f(Prismatic<2>{});
          return;
      }
    case JointType::spherical:
      f(Spherical{});
      return;
    default:
      f(Root{});
      return;
  }
}

// --- Joint transform: computes the data of `to_child` and `to_parent`. ----------------------------------------------

template <int K, class S>
GRAPNEL_INLINE void place(Revolute<K>, const TreeLink<S>& link, std::span<const S> q, LinkScratch<S>& w) {
  w.angle = sine_cosine(S(link.sign * q[link.q]));
  w.p_PL = link.X_PF.p;
}
template <int K, class S>
GRAPNEL_INLINE void place(Prismatic<K>, const TreeLink<S>& link, std::span<const S> q, LinkScratch<S>& w) {
  const S travel = link.sign * q[link.q];
  w.p_PL = link.X_PF.p + (link.rotated ? travel * link.X_PF.R.column(K) : travel * Vector3<S>::unit(K));
}
template <class S>
GRAPNEL_INLINE void place(Spherical, const TreeLink<S>& link, std::span<const S> q, LinkScratch<S>& w) {
  w.R_FL = rotation_matrix(Quaternion<S>{q[link.q], q[link.q + 1], q[link.q + 2], q[link.q + 3]});
  w.p_PL = link.X_PF.p;
}

/// Joint transforms of all links. A separate sweep, because sines and cosines are long chains of operations that are
/// independent of each other.
template <class S>
void place_links(const Tree<S>& tree, std::span<const S> q, std::vector<LinkScratch<S>>& scratch) {
  const std::size_t count = tree.links.size();
  for (std::size_t n = 0; n < count; ++n) {
    const TreeLink<S>& link = tree.links[n];
    visit_joint(link, [&](auto joint) GRAPNEL_INLINE_LAMBDA {
      if constexpr (!kIsRoot<decltype(joint)>) place(joint, link, q, scratch[n]);
    });
  }
}

// --- Components from the parent's frame to the link's and back. -----------------------------------------------------

template <int K, class S>
GRAPNEL_INLINE Vector3<S> joint_back(Revolute<K>, const LinkScratch<S>& w, const Vector3<S>& x) {
  return rotate_back_about<K>(w.angle, x);
}
template <int K, class S>
GRAPNEL_INLINE Vector3<S> joint_back(Prismatic<K>, const LinkScratch<S>&, const Vector3<S>& x) {
  return x;
}
template <class S>
GRAPNEL_INLINE Vector3<S> joint_back(Spherical, const LinkScratch<S>& w, const Vector3<S>& x) {
  return transposed_times(w.R_FL, x);
}
template <int K, class S>
GRAPNEL_INLINE Vector3<S> joint_forth(Revolute<K>, const LinkScratch<S>& w, const Vector3<S>& x) {
  return rotate_about<K>(w.angle, x);
}
template <int K, class S>
GRAPNEL_INLINE Vector3<S> joint_forth(Prismatic<K>, const LinkScratch<S>&, const Vector3<S>& x) {
  return x;
}
template <class S>
GRAPNEL_INLINE Vector3<S> joint_forth(Spherical, const LinkScratch<S>& w, const Vector3<S>& x) {
  return w.R_FL * x;
}
template <class Joint, class S>
GRAPNEL_INLINE Vector3<S> to_link(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, const Vector3<S>& x) {
  return joint_back(joint, w, link.rotated ? transposed_times(link.X_PF.R, x) : x);
}
template <class Joint, class S>
GRAPNEL_INLINE Vector3<S> to_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                    const Vector3<S>& x) {
  const Vector3<S> y = joint_forth(joint, w, x);
  return link.rotated ? link.X_PF.R * y : y;
}

/// A motion vector of the parent at its origin, transformed to the link's origin and frame.
template <class Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE SpatialVector<kKind, S> motion_to_link(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                      const SpatialVector<kKind, S>& V) {
  return {to_link(joint, link, w, V.angular), to_link(joint, link, w, V.linear + cross(V.angular, w.p_PL))};
}
/// A wrench on the link at its origin, transformed to the parent's origin and frame.
template <class Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE SpatialVector<kKind, S> force_to_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                       const SpatialVector<kKind, S>& F) {
  const Vector3<S> f = to_parent(joint, link, w, F.linear);
  return {to_parent(joint, link, w, F.angular) + cross(w.p_PL, f), f};
}

// --- The joint's own motion S v and the velocity-dependent V x S v. -------------------------------------------------

/// Component of a motion or a wrench along the joint's axis: S^T F.
template <OneAxis Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE S& along(Joint, SpatialVector<kKind, S>& F) {
  return (Joint::kTurns ? F.angular : F.linear)[Joint::kAxis];
}
template <OneAxis Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE const S& along(Joint, const SpatialVector<kKind, S>& F) {
  return (Joint::kTurns ? F.angular : F.linear)[Joint::kAxis];
}
template <OneAxis Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE void add_joint_motion(Joint joint, const TreeLink<S>& link, std::span<const S> v,
                                     SpatialVector<kKind, S>& V) {
  along(joint, V) += link.sign * v[link.v];
}
template <class S, SpatialKind kKind>
GRAPNEL_INLINE void add_joint_motion(Spherical, const TreeLink<S>& link, std::span<const S> v,
                                     SpatialVector<kKind, S>& V) {
  for (int k = 0; k < 3; ++k) V.angular[k] += v[link.v + k];
}

/// The twist of a link with a known joint transform from its parent's twist: one step of t = N_l N_d v.
template <class Joint, class S>
GRAPNEL_INLINE void move(Joint joint, const TreeLink<S>& link, std::span<const S> v, const Twist<S>& V_parent,
                         LinkScratch<S>& w) {
  w.V = motion_to_link(joint, link, w, V_parent);
  add_joint_motion(joint, link, v, w.V);
}
/// A link's joint transform and twist.
template <class Joint, class S>
GRAPNEL_INLINE void follow(Joint joint, const TreeLink<S>& link, std::span<const S> q, std::span<const S> v,
                           const Twist<S>& V_parent, LinkScratch<S>& w) {
  place(joint, link, q, w);
  move(joint, link, v, V_parent, w);
}

template <int K, class S>
GRAPNEL_INLINE SpatialAcceleration<S> joint_bias(Revolute<K>, const TreeLink<S>& link, std::span<const S> v,
                                                 const Twist<S>& V) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  const S rate = link.sign * v[link.v];
  SpatialAcceleration<S> c;
  c.angular[K] = c.linear[K] = S(0);
  c.angular[i] = rate * V.angular[j], c.angular[j] = -(rate * V.angular[i]);
  c.linear[i] = rate * V.linear[j], c.linear[j] = -(rate * V.linear[i]);
  return c;
}
template <int K, class S>
GRAPNEL_INLINE SpatialAcceleration<S> joint_bias(Prismatic<K>, const TreeLink<S>& link, std::span<const S> v,
                                                 const Twist<S>& V) {
  const S rate = link.sign * v[link.v];
  return {Vector3<S>::zero(), cross(V.angular, rate * Vector3<S>::unit(K))};
}
template <class S>
GRAPNEL_INLINE SpatialAcceleration<S> joint_bias(Spherical, const TreeLink<S>& link, std::span<const S> v,
                                                 const Twist<S>& V) {
  const Vector3<S> w{v[link.v], v[link.v + 1], v[link.v + 2]};
  return {cross(V.angular, w), cross(V.linear, w)};
}

// --- Rotors with a stated axis: (19.7) to (19.11) of docs/theory. -------------------------------------------------

/// The rotor's spin momentum per joint rate, in the link's frame; the parent carries it.
template <OneAxis Joint, class S>
GRAPNEL_INLINE Vector3<S> rotor_in_link(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w) {
  return to_link(joint, link, w, link.rotor);
}
/// The moment required to rotate the rotor's spin with its carrier, on the parent.
template <class S>
GRAPNEL_INLINE Vector3<S> gyroscopic_moment(const TreeLink<S>& link, std::span<const S> v, const Vector3<S>& w_parent) {
  return cross(w_parent, S(link.sign * v[link.v]) * link.rotor);
}

// --- S^T F: the generalized force a wrench exerts at the joint. -----------------------------------------------------

/// All components of S^T F: put(velocity, value).
template <OneAxis Joint, class S, SpatialKind kKind, class Put>
GRAPNEL_INLINE void put_forces(Joint joint, const TreeLink<S>& link, const SpatialVector<kKind, S>& F, Put put) {
  put(link.v, S(link.sign * along(joint, F)));
}
template <class S, SpatialKind kKind, class Put>
GRAPNEL_INLINE void put_forces(Spherical, const TreeLink<S>& link, const SpatialVector<kKind, S>& F, Put put) {
  for (int k = 0; k < 3; ++k) put(link.v + k, F.angular[k]);
}
template <class S, SpatialKind kKind, class Put>
GRAPNEL_INLINE void put_forces(Root, const TreeLink<S>& link, const SpatialVector<kKind, S>& F, Put put) {
  if (link.joint != JointType::free) return;
  for (int k = 0; k < 3; ++k) put(link.v + k, F.angular[k]), put(link.v + 3 + k, F.linear[k]);
}

// --- Orientations, inertias and momenta between the link's frame and its parent's. -----------------------------------

/// A link's orientation from that of its joint frame.
template <int K, class S>
GRAPNEL_INLINE Rotation<S> joint_rotation(Revolute<K>, const LinkScratch<S>& w, const Rotation<S>& R_WF) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  Rotation<S> R;
  for (int r = 0; r < 3; ++r) {
    R.m[r][K] = R_WF.m[r][K];
    R.m[r][i] = w.angle.cosine * R_WF.m[r][i] + w.angle.sine * R_WF.m[r][j];
    R.m[r][j] = w.angle.cosine * R_WF.m[r][j] - w.angle.sine * R_WF.m[r][i];
  }
  return R;
}
template <int K, class S>
GRAPNEL_INLINE Rotation<S> joint_rotation(Prismatic<K>, const LinkScratch<S>&, const Rotation<S>& R_WF) {
  return R_WF;
}
template <class S>
GRAPNEL_INLINE Rotation<S> joint_rotation(Spherical, const LinkScratch<S>& w, const Rotation<S>& R_WF) {
  return R_WF * w.R_FL;
}
template <int K, class S>
GRAPNEL_INLINE void rotate_inertia(Revolute<K>, const LinkScratch<S>& w, Symmetric3<S>& J) {
  rotate_about<K>(w.angle, J);
}
template <int K, class S>
GRAPNEL_INLINE void rotate_inertia(Revolute<K>, const LinkScratch<S>& w, ArticulatedInertia<S>& I) {
  rotate_about<K>(w.angle, I);
}
template <int K, class Inertia, class S>
GRAPNEL_INLINE void rotate_inertia(Prismatic<K>, const LinkScratch<S>&, Inertia&) {}
template <class S>
GRAPNEL_INLINE void rotate_inertia(Spherical, const LinkScratch<S>& w, Symmetric3<S>& J) {
  J = rotate(w.R_FL, J);
}
template <class S>
GRAPNEL_INLINE void rotate_inertia(Spherical, const LinkScratch<S>& w, ArticulatedInertia<S>& I) {
  rotate_general(I, w.R_FL);
}
/// A rigid inertia transformed to the parent's frame.
template <class Joint, class S>
GRAPNEL_INLINE RigidBodyInertia<S> inertia_to_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                     const RigidBodyInertia<S>& I) {
  Symmetric3<S> J = I.rotational;
  Vector3<S> h = joint_forth(joint, w, I.first_moment);
  rotate_inertia(joint, w, J);
  if (link.rotated) {
    J = rotate(link.X_PF.R, J);
    h = link.X_PF.R * h;
  }
  return shift_origin(RigidBodyInertia<S>{I.mass, h, J}, w.p_PL);
}
/// Momentum of an inertia when joint direction k moves with unit rate: I S_k.
template <int K, class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Revolute<K>, const RigidBodyInertia<S>& I, int) {
  const Vector3<S>& h = I.first_moment;
  return {{I.rotational(0, K), I.rotational(1, K), I.rotational(2, K)}, cross(Vector3<S>::unit(K), h)};
}
template <int K, class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Prismatic<K>, const RigidBodyInertia<S>& I, int) {
  return {cross(I.first_moment, Vector3<S>::unit(K)), I.mass * Vector3<S>::unit(K)};
}
template <class S>
GRAPNEL_INLINE Momentum<S> unit_momentum(Spherical, const RigidBodyInertia<S>& I, int k) {
  return {{I.rotational(0, k), I.rotational(1, k), I.rotational(2, k)}, cross(Vector3<S>::unit(k), I.first_moment)};
}

// --- Elimination of joints: the steps of forward dynamics. -----------------------------------------------------------

// The sum of (4.8). The first child also adds the carrier's own inertia: its structure is still known there, and the
// first sweep need not write it out.
template <class S>
GRAPNEL_INLINE void receive(const TreeLink<S>& carrier, const ArticulatedInertia<S>& I, LinkScratch<S>& parent) {
  if (parent.carries) {
    parent.I += I;
  } else {
    set_sum(parent.I, carrier.inertia, I);
    parent.carries = true;
  }
}

// One column of the factorization (4.9).
template <class S>
struct Column {
  Wrench<S> U;  // I S: wrench per unit acceleration of the joint
  S u;          // force - S^T p
};
// Divides once by D = S^T I S + armature: the third sweep, a chain of dependent steps, then only multiplies and adds.
template <class S>
GRAPNEL_INLINE void store_gain(const Column<S>& column, const S& D, LinkScratch<S>& w) {
  const S D_inverse = S(1) / D;
  w.G = D_inverse * column.U;
  w.g = D_inverse * column.u;
}

// Inertia and (returned) bias wrench that the joint passes to the parent, in the link's frame:
//   I_a = I - U D^-1 U^T,   p_a = p + I_a c + U D^-1 u,
// the terms of (4.8) and (4.11) of docs/theory, for a general structure; c is the bias acceleration (Featherstone
// 2008, eqs. 7.25, 7.26). Written number by number: with packs, structures of this size that are returned or assigned
// as a whole go through memory (a sixth of the time).
template <class S>
GRAPNEL_INLINE Wrench<S> eliminate(const Column<S>& column, const LinkScratch<S>& w, ArticulatedInertia<S>& I) {
  const Vector3<S>&a = w.G.angular, &l = w.G.linear, &Ua = column.U.angular, &Ul = column.U.linear;
  const Symmetric3<S>&J = w.I.J, &M = w.I.M;
  I.J.xx = J.xx - a[0] * Ua[0], I.J.yy = J.yy - a[1] * Ua[1], I.J.zz = J.zz - a[2] * Ua[2];
  I.J.xy = J.xy - a[0] * Ua[1], I.J.xz = J.xz - a[0] * Ua[2], I.J.yz = J.yz - a[1] * Ua[2];
  GRAPNEL_UNROLL
  for (int r = 0; r < 3; ++r) {
    GRAPNEL_UNROLL
    for (int c = 0; c < 3; ++c) I.H[r][c] = w.I.H[r][c] - a[r] * Ul[c];
  }
  I.M.xx = M.xx - l[0] * Ul[0], I.M.yy = M.yy - l[1] * Ul[1], I.M.zz = M.zz - l[2] * Ul[2];
  I.M.xy = M.xy - l[0] * Ul[1], I.M.xz = M.xz - l[0] * Ul[2], I.M.yz = M.yz - l[1] * Ul[2];
  Wrench<S> p = w.p + I * w.bias;
  p += column.u * w.G;
  return p;
}

// Likewise for a revolute joint without rotor. The moment row of the axis and its products vanish exactly, and c has no
// component along the axis. The inertia is rotated to the axes of the joint's frame and the wrench is passed to the
// parent in the same function. Blocks of the inertia are processed one by one, and each number is loaded where needed,
// since packs of the whole inertia exceed the registers (16 with AVX2).
template <int K, class S>
GRAPNEL_INLINE void eliminate_revolute(Revolute<K> joint, const TreeLink<S>& link, const Column<S>& column,
                                       const LinkScratch<S>& w, ArticulatedInertia<S>& I, LinkScratch<S>& parent) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  const Vector3<S>&a = w.G.angular, &l = w.G.linear, &Ua = column.U.angular, &Ul = column.U.linear;
  const Vector3<S>&ca = w.bias.angular, &cl = w.bias.linear;

  I.J(i, i) = w.I.J(i, i) - a[i] * Ua[i];
  I.J(i, j) = w.I.J(i, j) - a[i] * Ua[j];
  I.J(j, j) = w.I.J(j, j) - a[j] * Ua[j];
  I.J(K, K) = I.J(i, K) = I.J(j, K) = S(0);
  const S moment_i = I.J(i, i) * ca[i] + I.J(i, j) * ca[j], moment_j = I.J(i, j) * ca[i] + I.J(j, j) * ca[j];
  rotate_block_about<K>(w.angle, I.J);

  I.M.xx = w.I.M.xx - l[0] * Ul[0], I.M.yy = w.I.M.yy - l[1] * Ul[1], I.M.zz = w.I.M.zz - l[2] * Ul[2];
  I.M.xy = w.I.M.xy - l[0] * Ul[1], I.M.xz = w.I.M.xz - l[0] * Ul[2], I.M.yz = w.I.M.yz - l[1] * Ul[2];
  Vector3<S> force;
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) force[c] = I.M(c, i) * cl[i] + I.M(c, j) * cl[j];
  rotate_about<K>(w.angle, I.M);

  Wrench<S> p;
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) {
    I.H[K][c] = S(0);
    I.H[i][c] = w.I.H[i][c] - a[i] * Ul[c];
    I.H[j][c] = w.I.H[j][c] - a[j] * Ul[c];
    p.linear[c] = w.p.linear[c] + (force[c] + I.H[i][c] * ca[i] + I.H[j][c] * ca[j]);
  }
  p.angular[i] = w.p.angular[i] + (moment_i + I.H[i][i] * cl[i] + I.H[i][j] * cl[j]);
  p.angular[j] = w.p.angular[j] + (moment_j + I.H[j][i] * cl[i] + I.H[j][j] * cl[j]);
  p.angular[K] = w.p.angular[K];
  p += column.u * w.G;
  parent.p += force_to_parent(joint, link, w, p);
  rotate_rows_about<K>(w.angle, I.H);
}

// Contribution of a rotor to the column, (19.9): its spin couples the joint with the parent's angular acceleration.
template <OneAxis Joint, class S>
GRAPNEL_INLINE void couple_rotor(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w, Column<S>& column) {
  if (!link.has_rotor) return;
  const Vector3<S> r = rotor_in_link(joint, link, w);
  column.U.angular += r;
  column.u += dot(r, w.bias.angular);
}

// Transforms from the link's frame at its joint to the parent's frame, then to the parent's origin.
template <class S>
GRAPNEL_INLINE void shift_to_parent(const TreeLink<S>& link, const Vector3<S>& p_PL, ArticulatedInertia<S>& I) {
  if (link.rotated) rotate_general(I, link.X_PF.R);
  shift_origin(I, p_PL);
}

// S^T I S + armature.
template <OneAxis Joint, class S>
GRAPNEL_INLINE S joint_inertia(Joint, const TreeLink<S>& link, const LinkScratch<S>& w) {
  return (Joint::kTurns ? w.I.J : w.I.M)(Joint::kAxis, Joint::kAxis) + link.armature;
}

// For a free joint: passes inertia and bias wrench to the parent.
template <int K, class S>
GRAPNEL_INLINE void send(Revolute<K> joint, const TreeLink<S>& link, std::span<const S> force, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  Column<S> column{{{w.I.J(0, K), w.I.J(1, K), w.I.J(2, K)}, {w.I.H[K][0], w.I.H[K][1], w.I.H[K][2]}},
                   link.sign * force[link.v] - w.p.angular[K]};
  couple_rotor(joint, link, w, column);
  store_gain(column, joint_inertia(joint, link, w), w);
  ArticulatedInertia<S> I;
  if (!link.has_armature) {
    eliminate_revolute(joint, link, column, w, I, parent);
    if (link.rotated) {
      shift_to_parent(link, w.p_PL, I);
    } else {
      shift_behind_joint<K>(I, w.p_PL);
    }
  } else {
    parent.p += force_to_parent(joint, link, w, eliminate(column, w, I));
    rotate_about<K>(w.angle, I);
    shift_to_parent(link, w.p_PL, I);
  }
  receive(carrier, I, parent);
}

template <int K, class S>
GRAPNEL_INLINE void send(Prismatic<K> joint, const TreeLink<S>& link, std::span<const S> force, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  Column<S> column{{{w.I.H[0][K], w.I.H[1][K], w.I.H[2][K]}, {w.I.M(0, K), w.I.M(1, K), w.I.M(2, K)}},
                   link.sign * force[link.v] - w.p.linear[K]};
  couple_rotor(joint, link, w, column);
  store_gain(column, joint_inertia(joint, link, w), w);
  ArticulatedInertia<S> I;
  parent.p += force_to_parent(joint, link, w, eliminate(column, w, I));
  shift_to_parent(link, w.p_PL, I);
  receive(carrier, I, parent);
}

// A spherical joint transmits no moment: with I = [J H; H^T M], I_a = [0 0; 0 M - H^T J^-1 H].
template <class S>
GRAPNEL_INLINE void send(Spherical joint, const TreeLink<S>& link, std::span<const S> force, LinkScratch<S>& w,
                         const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  const SymmetricFactor3<S> J(w.I.J);
  const Vector3<S> torque{force[link.v], force[link.v + 1], force[link.v + 2]};
  const Vector3<S> u = torque - w.p.angular;
  ArticulatedInertia<S> I;
  I.J = Symmetric3<S>::zero();
  for (auto& row : I.H) row[0] = row[1] = row[2] = S(0);
  Vector3<S> X[3];  // columns of J^-1 H
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) X[c] = J.solve({w.I.H[0][c], w.I.H[1][c], w.I.H[2][c]});
  const auto HtX = [&](int r, int c) { return w.I.H[0][r] * X[c][0] + w.I.H[1][r] * X[c][1] + w.I.H[2][r] * X[c][2]; };
  const Symmetric3<S>& M = w.I.M;
  I.M = {M.xx - HtX(0, 0), M.yy - HtX(1, 1), M.zz - HtX(2, 2), M.xy - HtX(0, 1), M.xz - HtX(0, 2), M.yz - HtX(1, 2)};
  // p_a = p + I_a c + U D^-1 u; its moment is p.angular + u = torque.
  Wrench<S> p{torque, w.p.linear + I.M * w.bias.linear};
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) p.linear[c] += dot(X[c], u);
  I.M = rotate(w.R_FL, I.M);
  shift_to_parent(link, w.p_PL, I);
  receive(carrier, I, parent);
  parent.p += force_to_parent(joint, link, w, p);
}

// For a joint with prescribed acceleration: the inertia is passed on unchanged, and S times the acceleration is added
// to the bias.
template <class Joint, class S>
GRAPNEL_INLINE void send_rigid(Joint joint, const TreeLink<S>& link, std::span<const S> acceleration, LinkScratch<S>& w,
                               const TreeLink<S>& carrier, LinkScratch<S>& parent) {
  add_joint_motion(joint, link, acceleration, w.bias);
  ArticulatedInertia<S> I = loaded(w.I);
  const Wrench<S> p = w.p + I * w.bias;
  rotate_inertia(joint, w, I);
  shift_to_parent(link, w.p_PL, I);
  receive(carrier, I, parent);
  parent.p += force_to_parent(joint, link, w, p);
  if constexpr (OneAxis<Joint>) {
    if (link.has_rotor) parent.p.angular += S(link.sign * acceleration[link.v]) * link.rotor;
  }
}

// The third sweep's step: adds the joint's acceleration to w.A, which contains the transformed acceleration of the
// parent.
template <OneAxis Joint, class S>
GRAPNEL_INLINE void accelerate(Joint joint, const TreeLink<S>& link, const DynamicsInput<S>& in, bool rigid,
                               LinkScratch<S>& w, const DynamicsOutput<S>& out) {
  const auto [vdot, force] = out;
  if (rigid) {
    vdot[link.v] = in.acceleration[link.v];
    force[link.v] = link.sign * along(joint, w.I * w.A + w.p) + link.armature * vdot[link.v];
    if (link.has_rotor) force[link.v] += link.sign * dot(rotor_in_link(joint, link, w), w.A.angular - w.bias.angular);
  } else {
    const S rate = w.g - dot(w.G.angular, w.A.angular) - dot(w.G.linear, w.A.linear);
    along(joint, w.A) += rate;
    vdot[link.v] = link.sign * rate;
    force[link.v] = in.force[link.v];
  }
}
template <class S>
GRAPNEL_INLINE void accelerate(Spherical, const TreeLink<S>& link, const DynamicsInput<S>& in, bool rigid,
                               LinkScratch<S>& w, const DynamicsOutput<S>& out) {
  const auto [vdot, force] = out;
  const Wrench<S> F = w.I * w.A + w.p;
  if (rigid) {
    for (int k = 0; k < 3; ++k) vdot[link.v + k] = in.acceleration[link.v + k], force[link.v + k] = F.angular[k];
  } else {
    const Vector3<S> torque{in.force[link.v], in.force[link.v + 1], in.force[link.v + 2]};
    const Vector3<S> rate = SymmetricFactor3<S>(w.I.J).solve(torque - F.angular);
    w.A.angular += rate;
    for (int k = 0; k < 3; ++k) vdot[link.v + k] = rate[k], force[link.v + k] = torque[k];
  }
}

// --- Modal joints: (4.14) to (4.16) of docs/theory. ---------------------------------------------------------------
//
// Let A' be the acceleration arriving at a link from the inner side. The joints beyond pass on the wrench I A' + p + U
// eta'', and the modes require D eta'' + r + U^T A' = 0. A further joint adds c + S s eta'' to A', s = sign times its
// row of shapes, and these become
//   D + U^T S s + s^T S^T U + s^T (S^T I S) s,   r + U^T c + s^T (S^T (p + I c) - force),   U + I S s,   p + I c,
// with I unchanged. At the innermost joint of the chain the modes are eliminated, D = L L^T, G = U L^-T, y = L^-1 r:
//   I_a = I - G G^T,   p_a = p - G y,   eta'' = -L^-T (y + G^T A').

/// In place: D = L L^T, G and y from U and r.
inline void factor_modes(int modes, ChainScratch& c) {
  const auto m = static_cast<std::size_t>(modes);
  for (std::size_t j = 0; j < m; ++j) {
    for (std::size_t k = 0; k < j; ++k) c.D[j * m + j] -= c.D[j * m + k] * c.D[j * m + k];
    c.D[j * m + j] = std::sqrt(c.D[j * m + j]);
    for (std::size_t i = j + 1; i < m; ++i) {
      for (std::size_t k = 0; k < j; ++k) c.D[i * m + j] -= c.D[i * m + k] * c.D[j * m + k];
      c.D[i * m + j] /= c.D[j * m + j];
    }
  }
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      c.U[i] -= c.D[i * m + k] * c.U[k];
      c.y[i] -= c.D[i * m + k] * c.y[k];
    }
    const double inverse = 1 / c.D[i * m + i];
    c.U[i] = inverse * c.U[i], c.y[i] *= inverse;
  }
}

inline void subtract_product(const Wrenchd& G, ArticulatedInertia<double>& I) {
  const Vector3d &a = G.angular, &l = G.linear;
  I.J.xx -= a[0] * a[0], I.J.yy -= a[1] * a[1], I.J.zz -= a[2] * a[2];
  I.J.xy -= a[0] * a[1], I.J.xz -= a[0] * a[2], I.J.yz -= a[1] * a[2];
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) I.H[r][c] -= a[r] * l[c];
  }
  I.M.xx -= l[0] * l[0], I.M.yy -= l[1] * l[1], I.M.zz -= l[2] * l[2];
  I.M.xy -= l[0] * l[1], I.M.xz -= l[0] * l[2], I.M.yz -= l[1] * l[2];
}

/// I S of a joint of one axis.
template <int K>
GRAPNEL_INLINE Wrenchd axis_column(Revolute<K>, const ArticulatedInertia<double>& I) {
  return {{I.J(0, K), I.J(1, K), I.J(2, K)}, {I.H[K][0], I.H[K][1], I.H[K][2]}};
}
template <int K>
GRAPNEL_INLINE Wrenchd axis_column(Prismatic<K>, const ArticulatedInertia<double>& I) {
  return {{I.H[0][K], I.H[1][K], I.H[2][K]}, {I.M(0, K), I.M(1, K), I.M(2, K)}};
}

/// A link and its scratch; a modal chain and its scratch.
struct LinkPlace {
  const TreeLink<double>& link;
  LinkScratch<double>& scratch;
};
struct ChainPlace {
  const ModalChain& chain;
  ChainScratch& scratch;
};

/// The second sweep's step.
template <OneAxis Joint>
void send_modal(Joint joint, const LinkPlace& from, const ChainPlace& modes, std::span<const double> force,
                const LinkPlace& to) {
  const auto& [link, w] = from;
  const auto& [chain, c] = modes;
  const auto& [carrier, parent] = to;
  const auto m = static_cast<std::size_t>(chain.modes);
  if (link.member + 1 == static_cast<int>(chain.links.size())) {
    std::fill(c.U.begin(), c.U.end(), Wrenchd::zero());
    std::fill(c.D.begin(), c.D.end(), 0.0);
    std::fill(c.y.begin(), c.y.end(), 0.0);
  }
  const double* shape = chain.row(link.member);
  ArticulatedInertia<double> I = loaded(w.I);
  const Wrenchd IS = axis_column(joint, I);
  Wrenchd p = w.p + I * w.bias;
  const double lacking = along(joint, p) - link.sign * force[link.v], inertia = joint_inertia(joint, link, w);
  for (std::size_t i = 0; i < m; ++i) {
    const double s = link.sign * shape[i], US = along(joint, c.U[i]);
    for (std::size_t k = 0; k <= i; ++k)
      c.D[i * m + k] += US * (link.sign * shape[k]) + s * (along(joint, c.U[k]) + inertia * (link.sign * shape[k]));
    c.y[i] += dot(c.U[i].angular, w.bias.angular) + dot(c.U[i].linear, w.bias.linear) + s * lacking;
  }
  for (std::size_t i = 0; i < m; ++i) c.U[i] += (link.sign * shape[i]) * IS;
  if (link.member == 0) {
    factor_modes(chain.modes, c);
    for (std::size_t i = 0; i < m; ++i) {
      subtract_product(c.U[i], I);
      p -= c.y[i] * c.U[i];
    }
  } else {
    for (Wrenchd& U : c.U) U = force_to_parent(joint, link, w, U);
  }
  rotate_inertia(joint, w, I);
  shift_to_parent(link, w.p_PL, I);
  receive(carrier, I, parent);
  parent.p += force_to_parent(joint, link, w, p);
}

/// The third sweep's step; w.A contains the parent's transformed acceleration.
template <OneAxis Joint>
void accelerate_modal(Joint joint, const LinkPlace& at, const ChainPlace& modes, const DynamicsInput<double>& in,
                      const DynamicsOutput<double>& out) {
  const auto& [link, w] = at;
  const auto& [chain, c] = modes;
  const auto [vdot, force] = out;
  const auto m = static_cast<std::size_t>(chain.modes);
  if (link.member == 0) {
    for (std::size_t i = m; i-- > 0;) {
      double sum = -c.y[i] - dot(c.U[i].angular, w.A.angular) - dot(c.U[i].linear, w.A.linear);
      for (std::size_t k = i + 1; k < m; ++k) sum -= c.D[k * m + i] * c.acceleration[k];
      c.acceleration[i] = sum / c.D[i * m + i];
    }
  }
  const double* shape = chain.row(link.member);
  double rate = 0;
  for (std::size_t i = 0; i < m; ++i) rate += shape[i] * c.acceleration[i];
  w.A = w.A + w.bias;
  along(joint, w.A) += link.sign * rate;
  vdot[link.v] = rate;
  force[link.v] = in.force[link.v];
}

// --- Roots. ----------------------------------------------------------------------------------------------------------

/// Gravity expressed in a root link's frame.
template <class S>
GRAPNEL_INLINE Vector3<S> gravity_in_root(const TreeLink<S>& link, std::span<const S> q, const Vector3<S>& gravity) {
  if (link.joint == JointType::fixed) return transposed_times(link.X_PF.R, gravity);
  return transposed_times(rotation_matrix(Quaternion<S>{q[link.q + 3], q[link.q + 4], q[link.q + 5], q[link.q + 6]}),
                          gravity);
}

template <class S>
GRAPNEL_INLINE Twist<S> root_velocity(const TreeLink<S>& link, std::span<const S> v) {
  if (link.joint == JointType::fixed) return Twist<S>::zero();
  return {{v[link.v], v[link.v + 1], v[link.v + 2]}, {v[link.v + 3], v[link.v + 4], v[link.v + 5]}};
}

}  // namespace grapnel::recursion
