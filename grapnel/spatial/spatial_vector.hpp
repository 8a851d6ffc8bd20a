#pragma once

/// @file
/// Six-dimensional vectors of rigid-body motion and loads, ordered [angular; linear] as in the thesis.
///
/// Twist, acceleration, wrench, momentum and impulse are distinct types: adding a force to an impulse, or a twist to a
/// wrench, does not compile. All have a reference point (the point whose velocity is `linear`, or about which the
/// moment `angular` is taken) and a frame of expression; both are named where a variable is declared (`V_WE`: of E, at
/// E's origin, in W).

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// Kind of a spatial vector; determines the available operations.
enum class SpatialKind { twist, acceleration, wrench, momentum, impulse };

template <SpatialKind kKind, class S = double>
struct SpatialVector {
  using Scalar = S;
  Vector3<S> angular;
  Vector3<S> linear;

  static GRAPNEL_INLINE constexpr SpatialVector zero() { return {Vector3<S>::zero(), Vector3<S>::zero()}; }
  GRAPNEL_INLINE SpatialVector& operator+=(const SpatialVector& b) {
    angular += b.angular, linear += b.linear;
    return *this;
  }
  GRAPNEL_INLINE SpatialVector& operator-=(const SpatialVector& b) {
    angular -= b.angular, linear -= b.linear;
    return *this;
  }
};

template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> operator+(SpatialVector<kKind, S> a, const SpatialVector<kKind, S>& b) {
  return a += b;
}
template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> operator-(SpatialVector<kKind, S> a, const SpatialVector<kKind, S>& b) {
  return a -= b;
}
template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> operator-(const SpatialVector<kKind, S>& a) {
  return {-a.angular, -a.linear};
}
template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> operator*(const S& s, const SpatialVector<kKind, S>& a) {
  return {s * a.angular, s * a.linear};
}

/// [rad/s; m/s]
template <class S = double>
using Twist = SpatialVector<SpatialKind::twist, S>;
/// Spatial acceleration, the derivative of a body-fixed twist's components [rad/s^2; m/s^2]. Its linear part is not the
/// acceleration of the origin: that is `linear + angular_velocity x velocity`.
template <class S = double>
using SpatialAcceleration = SpatialVector<SpatialKind::acceleration, S>;
/// [N m; N]
template <class S = double>
using Wrench = SpatialVector<SpatialKind::wrench, S>;
/// [kg m^2/s; kg m/s]
template <class S = double>
using Momentum = SpatialVector<SpatialKind::momentum, S>;
/// [N m s; N s]
template <class S = double>
using Impulse = SpatialVector<SpatialKind::impulse, S>;

/// Power of a wrench on a twist [W], both at one point and in one frame.
template <class S>
GRAPNEL_INLINE S dot(const Wrench<S>& F, const Twist<S>& V) {
  return dot(F.angular, V.angular) + dot(F.linear, V.linear);
}
/// Twice the kinetic energy of a momentum moving with a twist [J].
template <class S>
GRAPNEL_INLINE S dot(const Momentum<S>& h, const Twist<S>& V) {
  return dot(h.angular, V.angular) + dot(h.linear, V.linear);
}
/// Work of an impulse on a (mean) twist [J].
template <class S>
GRAPNEL_INLINE S dot(const Impulse<S>& P, const Twist<S>& V) {
  return dot(P.angular, V.angular) + dot(P.linear, V.linear);
}

/// An impulse changes the momentum by its own value.
template <class S>
GRAPNEL_INLINE Momentum<S> operator+(const Momentum<S>& h, const Impulse<S>& P) {
  return {h.angular + P.angular, h.linear + P.linear};
}

/// The same motion at another point: `p` points from the old point to the new one, in the frame of expression.
template <SpatialKind kKind, class S>
requires(kKind == SpatialKind::twist || kKind == SpatialKind::acceleration)
    GRAPNEL_INLINE SpatialVector<kKind, S> shift(const SpatialVector<kKind, S>& V, const Vector3<S>& p) {
  return {V.angular, V.linear + cross(V.angular, p)};
}
/// The same wrench, momentum or impulse about another point: `p` points from the old point to the new one.
template <SpatialKind kKind, class S>
requires(kKind == SpatialKind::wrench || kKind == SpatialKind::momentum ||
         kKind == SpatialKind::impulse) GRAPNEL_INLINE SpatialVector<kKind, S> shift(const SpatialVector<kKind, S>& F,
                                                                                     const Vector3<S>& p) {
  return {F.angular - cross(p, F.linear), F.linear};
}
/// Re-expressed: from components in B to components in A for R = R_AB.
template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> operator*(const Rotation<S>& R, const SpatialVector<kKind, S>& V) {
  return {R * V.angular, R * V.linear};
}
template <SpatialKind kKind, class S>
GRAPNEL_INLINE SpatialVector<kKind, S> transposed_times(const Rotation<S>& R, const SpatialVector<kKind, S>& V) {
  return {transposed_times(R, V.angular), transposed_times(R, V.linear)};
}

/// Motion cross product V x A: the rate of a motion vector fixed in a body that moves with V.
template <class S>
GRAPNEL_INLINE SpatialAcceleration<S> cross_motion(const Twist<S>& V, const Twist<S>& A) {
  return {cross(V.angular, A.angular), cross(V.angular, A.linear) + cross(V.linear, A.angular)};
}
/// Force cross product V x* h: the wrench that rotates a momentum fixed in a body moving with V.
template <class S>
GRAPNEL_INLINE Wrench<S> cross_force(const Twist<S>& V, const Momentum<S>& h) {
  return {cross(V.angular, h.angular) + cross(V.linear, h.linear), cross(V.angular, h.linear)};
}

using Twistd = Twist<double>;
using SpatialAccelerationd = SpatialAcceleration<double>;
using Wrenchd = Wrench<double>;
using Momentumd = Momentum<double>;
using Impulsed = Impulse<double>;

// Rigid-body inertia about a frame's origin.

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
/// Wrench for a spatial acceleration of the body (without the velocity term V x* I V).
template <class S>
GRAPNEL_INLINE Wrench<S> operator*(const RigidBodyInertia<S>& I, const SpatialAcceleration<S>& A) {
  return {I.rotational * A.angular + cross(I.first_moment, A.linear),
          I.mass * A.linear + cross(A.angular, I.first_moment)};
}
/// The same inertia about another origin, axes unchanged: `p` points from the new origin to the old one.
template <class S>
GRAPNEL_INLINE RigidBodyInertia<S> shift_origin(const RigidBodyInertia<S>& I, const Vector3<S>& p) {
  // |c + p|^2 = |c|^2 + 2 c.p + |p|^2, written with the first moment h = m c to avoid a division by the mass.
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
