#pragma once

/// @file
/// Steps that the recursive kernels share: how a link's motion follows from its parent's, and how wrenches go back. One
/// overload per kind of joint, chosen once per link by `visit_joint`.

#include <span>

#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel::recursion {

/// A revolute joint about coordinate axis K of the link's frame.
template <int K>
struct Revolute {
  static constexpr bool kTurns = true;
  static constexpr int kAxis = K;
};
/// A prismatic joint along coordinate axis K.
template <int K>
struct Prismatic {
  static constexpr bool kTurns = false;
  static constexpr int kAxis = K;
};
struct Spherical {};
struct Root {};

/// Calls f with the tag of the link's joint.
template <class S, class F>
GRAPNEL_INLINE void visit_joint(const TreeLink<S>& link, F&& f) {
  switch (link.joint) {
    case JointType::revolute:
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

// --- Where the link is: fills what `to_child` and `to_parent` need. -------------------------------------------------

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

/// A motion vector of the parent at its origin, seen at the link's origin in the link's frame.
template <class Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE SpatialVector<kKind, S> motion_to_link(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                      const SpatialVector<kKind, S>& V) {
  return {to_link(joint, link, w, V.angular), to_link(joint, link, w, V.linear + cross(V.angular, w.p_PL))};
}
/// A wrench on the link at its origin, seen at the parent's origin in the parent's frame.
template <class Joint, class S, SpatialKind kKind>
GRAPNEL_INLINE SpatialVector<kKind, S> force_to_parent(Joint joint, const TreeLink<S>& link, const LinkScratch<S>& w,
                                                       const SpatialVector<kKind, S>& F) {
  const Vector3<S> f = to_parent(joint, link, w, F.linear);
  return {to_parent(joint, link, w, F.angular) + cross(w.p_PL, f), f};
}

// --- The joint's own motion S v and the velocity-dependent V x S v. -------------------------------------------------

template <int K, class S, SpatialKind kKind>
GRAPNEL_INLINE void add_joint_motion(Revolute<K>, const TreeLink<S>& link, std::span<const S> v,
                                     SpatialVector<kKind, S>& V) {
  V.angular[K] += link.sign * v[link.v];
}
template <int K, class S, SpatialKind kKind>
GRAPNEL_INLINE void add_joint_motion(Prismatic<K>, const TreeLink<S>& link, std::span<const S> v,
                                     SpatialVector<kKind, S>& V) {
  V.linear[K] += link.sign * v[link.v];
}
template <class S, SpatialKind kKind>
GRAPNEL_INLINE void add_joint_motion(Spherical, const TreeLink<S>& link, std::span<const S> v,
                                     SpatialVector<kKind, S>& V) {
  for (int k = 0; k < 3; ++k) V.angular[k] += v[link.v + k];
}

/// The twist of a link that has been placed from its parent's: one step of t = N_l N_d v.
template <class Joint, class S>
GRAPNEL_INLINE void move(Joint joint, const TreeLink<S>& link, std::span<const S> v, const Twist<S>& V_parent,
                         LinkScratch<S>& w) {
  w.V = motion_to_link(joint, link, w, V_parent);
  add_joint_motion(joint, link, v, w.V);
}
/// A link's place and its twist.
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

// --- S^T F: the generalized force a wrench exerts at the joint. -----------------------------------------------------

template <int K, class S, SpatialKind kKind>
GRAPNEL_INLINE S along(Revolute<K>, const SpatialVector<kKind, S>& F) {
  return F.angular[K];
}
template <int K, class S, SpatialKind kKind>
GRAPNEL_INLINE S along(Prismatic<K>, const SpatialVector<kKind, S>& F) {
  return F.linear[K];
}

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
