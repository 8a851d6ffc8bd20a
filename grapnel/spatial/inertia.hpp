#pragma once

/// @file
/// Rigid-body inertia about a frame's origin.

#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Mass, first moment and rotational inertia of a rigid body, about the origin of the frame it is expressed in.
template <class S = double>
struct RigidBodyInertia {
  S mass;                    // [kg]
  Vector3<S> first_moment;   // mass times centre of mass [kg m]
  Symmetric3<S> rotational;  // about the origin [kg m^2]

  static GRAPNEL_INLINE constexpr RigidBodyInertia zero() { return {S(0), Vector3<S>::zero(), Symmetric3<S>::zero()}; }

  /// From the mass, the centre of mass and the inertia tensor about the centre of mass.
  static GRAPNEL_INLINE RigidBodyInertia about_com(const S& mass, const Vector3<S>& com, const Symmetric3<S>& I_com) {
    return {mass, mass * com, I_com + point_mass_inertia(mass, com)};
  }
  GRAPNEL_INLINE RigidBodyInertia& operator+=(const RigidBodyInertia& b) {
    mass += b.mass, first_moment += b.first_moment, rotational += b.rotational;
    return *this;
  }
  /// Centre of mass; the mass must not be zero.
  GRAPNEL_INLINE Vector3<S> com() const { return (S(1) / mass) * first_moment; }
  /// Inertia tensor about the centre of mass; the mass must not be zero.
  GRAPNEL_INLINE Symmetric3<S> rotational_about_com() const { return rotational + point_mass_inertia(-mass, com()); }
};

/// Momentum of the body about the origin [n; p].
template <class S>
GRAPNEL_INLINE Momentum<S> operator*(const RigidBodyInertia<S>& I, const Twist<S>& V) {
  return {I.rotational * V.angular + cross(I.first_moment, V.linear),
          I.mass * V.linear + cross(V.angular, I.first_moment)};
}
/// Wrench that gives the body a spatial acceleration (without the velocity term V x* I V).
template <class S>
GRAPNEL_INLINE Wrench<S> operator*(const RigidBodyInertia<S>& I, const SpatialAcceleration<S>& A) {
  return {I.rotational * A.angular + cross(I.first_moment, A.linear),
          I.mass * A.linear + cross(A.angular, I.first_moment)};
}
/// The same inertia about another origin, axes unchanged: `p` leads from the new origin to the old one.
template <class S>
GRAPNEL_INLINE RigidBodyInertia<S> shift_origin(const RigidBodyInertia<S>& I, const Vector3<S>& p) {
  // |c + p|^2 = |c|^2 + 2 c.p + |p|^2, written with the first moment h = m c so that no division by the mass occurs.
  const Vector3<S>& h = I.first_moment;
  const S hp = dot(h, p);
  const S two(2);
  Symmetric3<S> J = I.rotational + point_mass_inertia(I.mass, p);
  J.xx += two * (hp - h[0] * p[0]), J.yy += two * (hp - h[1] * p[1]), J.zz += two * (hp - h[2] * p[2]);
  J.xy -= h[0] * p[1] + h[1] * p[0], J.xz -= h[0] * p[2] + h[2] * p[0], J.yz -= h[1] * p[2] + h[2] * p[1];
  return {I.mass, h + I.mass * p, J};
}
/// The body's inertia, given in B, expressed in A about A's origin.
template <class S>
GRAPNEL_INLINE RigidBodyInertia<S> operator*(const Pose<S>& X_AB, const RigidBodyInertia<S>& I_B) {
  return shift_origin(RigidBodyInertia<S>{I_B.mass, X_AB.R * I_B.first_moment, rotate(X_AB.R, I_B.rotational)}, X_AB.p);
}

using RigidBodyInertiad = RigidBodyInertia<double>;

}  // namespace grapnel
