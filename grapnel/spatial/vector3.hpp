#pragma once

/// @file
/// A three-dimensional vector and a symmetric 3 x 3 matrix: values without allocation. Independent of Eigen, so that
/// kernels can be compiled for several instruction sets in one process.

#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

template <class S = double>
struct Vector3 {
  S e[3];

  GRAPNEL_INLINE constexpr S& operator[](int i) { return e[i]; }
  GRAPNEL_INLINE constexpr const S& operator[](int i) const { return e[i]; }
  GRAPNEL_INLINE constexpr S& x() { return e[0]; }
  GRAPNEL_INLINE constexpr S& y() { return e[1]; }
  GRAPNEL_INLINE constexpr S& z() { return e[2]; }
  GRAPNEL_INLINE constexpr const S& x() const { return e[0]; }
  GRAPNEL_INLINE constexpr const S& y() const { return e[1]; }
  GRAPNEL_INLINE constexpr const S& z() const { return e[2]; }

  static GRAPNEL_INLINE constexpr Vector3 zero() { return {S(0), S(0), S(0)}; }
  /// Unit vector along coordinate axis k.
  static GRAPNEL_INLINE constexpr Vector3 unit(int k) { return {S(k == 0), S(k == 1), S(k == 2)}; }

  GRAPNEL_INLINE Vector3& operator+=(const Vector3& b) {
    e[0] += b.e[0], e[1] += b.e[1], e[2] += b.e[2];
    return *this;
  }
  GRAPNEL_INLINE Vector3& operator-=(const Vector3& b) {
    e[0] -= b.e[0], e[1] -= b.e[1], e[2] -= b.e[2];
    return *this;
  }
  GRAPNEL_INLINE Vector3& operator*=(const S& s) {
    e[0] *= s, e[1] *= s, e[2] *= s;
    return *this;
  }
};

template <class S>
GRAPNEL_INLINE Vector3<S> operator+(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class S>
GRAPNEL_INLINE Vector3<S> operator-(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class S>
GRAPNEL_INLINE Vector3<S> operator-(const Vector3<S>& a) {
  return {-a[0], -a[1], -a[2]};
}
template <class S>
GRAPNEL_INLINE Vector3<S> operator*(const S& s, const Vector3<S>& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
template <class S>
GRAPNEL_INLINE Vector3<S> operator*(const Vector3<S>& a, const S& s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
template <class S>
GRAPNEL_INLINE S dot(const Vector3<S>& a, const Vector3<S>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S>
GRAPNEL_INLINE Vector3<S> cross(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class S>
GRAPNEL_INLINE S norm(const Vector3<S>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

/// A symmetric 3 x 3 matrix by its six entries.
template <class S = double>
struct Symmetric3 {
  S xx, yy, zz, xy, xz, yz;

  static GRAPNEL_INLINE constexpr Symmetric3 zero() { return {S(0), S(0), S(0), S(0), S(0), S(0)}; }
  static GRAPNEL_INLINE constexpr Symmetric3 diagonal(const S& a, const S& b, const S& c) {
    return {a, b, c, S(0), S(0), S(0)};
  }

  /// Entry (i, j); the indices are compile-time constants wherever this is used in a kernel.
  GRAPNEL_INLINE constexpr const S& operator()(int i, int j) const {
    return i == j ? (i == 0 ? xx : i == 1 ? yy : zz) : (i + j == 1 ? xy : i + j == 2 ? xz : yz);
  }
  GRAPNEL_INLINE constexpr S& operator()(int i, int j) {
    return i == j ? (i == 0 ? xx : i == 1 ? yy : zz) : (i + j == 1 ? xy : i + j == 2 ? xz : yz);
  }
  GRAPNEL_INLINE Symmetric3& operator+=(const Symmetric3& b) {
    xx += b.xx, yy += b.yy, zz += b.zz, xy += b.xy, xz += b.xz, yz += b.yz;
    return *this;
  }
};

template <class S>
GRAPNEL_INLINE Symmetric3<S> operator+(Symmetric3<S> a, const Symmetric3<S>& b) {
  return a += b;
}
template <class S>
GRAPNEL_INLINE Vector3<S> operator*(const Symmetric3<S>& m, const Vector3<S>& a) {
  return {m.xx * a[0] + m.xy * a[1] + m.xz * a[2], m.xy * a[0] + m.yy * a[1] + m.yz * a[2],
          m.xz * a[0] + m.yz * a[1] + m.zz * a[2]};
}

/// The parallel-axis term m (|p|^2 1 - p p^T).
template <class S>
GRAPNEL_INLINE Symmetric3<S> point_mass_inertia(const S& mass, const Vector3<S>& p) {
  const Vector3<S> mp = mass * p;
  const S xx = mp[0] * p[0], yy = mp[1] * p[1], zz = mp[2] * p[2];
  return {yy + zz, xx + zz, xx + yy, -mp[0] * p[1], -mp[0] * p[2], -mp[1] * p[2]};
}

using Vector3d = Vector3<double>;
using Symmetric3d = Symmetric3<double>;

}  // namespace grapnel
