#pragma once

/// @file
/// Six-dimensional vectors of rigid-body motion and of what acts on it, ordered [angular; linear] as in the thesis.
///
/// Twist, acceleration, wrench, momentum and impulse are distinct types: adding a force to an impulse, or a twist to a
/// wrench, does not compile. All have a reference point (the point whose velocity is `linear`, or about which the
/// moment `angular` is taken) and a frame of expression; both are named where a variable is declared (`V_WE`: of E, at
/// E's origin, in W).

#include "grapnel/spatial/pose.hpp"

namespace grapnel {

/// What a spatial vector is; decides which operations exist.
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

/// An impulse changes momentum by its own value.
template <class S>
GRAPNEL_INLINE Momentum<S> operator+(const Momentum<S>& h, const Impulse<S>& P) {
  return {h.angular + P.angular, h.linear + P.linear};
}

/// The same motion seen at another point: `p` leads from the old point to the new one, in the frame of expression.
template <SpatialKind kKind, class S>
requires(kKind == SpatialKind::twist || kKind == SpatialKind::acceleration)
    GRAPNEL_INLINE SpatialVector<kKind, S> shift(const SpatialVector<kKind, S>& V, const Vector3<S>& p) {
  return {V.angular, V.linear + cross(V.angular, p)};
}
/// The same wrench, momentum or impulse about another point: `p` leads from the old point to the new one.
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
/// Force cross product V x* h: the wrench that turns a momentum fixed in a body that moves with V.
template <class S>
GRAPNEL_INLINE Wrench<S> cross_force(const Twist<S>& V, const Momentum<S>& h) {
  return {cross(V.angular, h.angular) + cross(V.linear, h.linear), cross(V.angular, h.linear)};
}

using Twistd = Twist<double>;
using SpatialAccelerationd = SpatialAcceleration<double>;
using Wrenchd = Wrench<double>;
using Momentumd = Momentum<double>;
using Impulsed = Impulse<double>;

}  // namespace grapnel
