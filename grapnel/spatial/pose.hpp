#pragma once

/// @file
/// Rotations, as matrices (for arithmetic) and unit quaternions (for states), and rigid transforms. `R_AB` maps
/// components in B to components in A. Quaternions are stored in the order (w, x, y, z).

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

template <class S = double>
struct Rotation {
  S m[3][3];  // row-major

  static GRAPNEL_INLINE constexpr Rotation identity() {
    return {{{S(1), S(0), S(0)}, {S(0), S(1), S(0)}, {S(0), S(0), S(1)}}};
  }
  GRAPNEL_INLINE constexpr const S& operator()(int i, int j) const { return m[i][j]; }
  GRAPNEL_INLINE constexpr S& operator()(int i, int j) { return m[i][j]; }
  GRAPNEL_INLINE Vector3<S> column(int j) const { return {m[0][j], m[1][j], m[2][j]}; }
};

/// R v: from components in B to components in A, for R = R_AB.
template <class S>
GRAPNEL_INLINE Vector3<S> operator*(const Rotation<S>& R, const Vector3<S>& v) {
  return {R.m[0][0] * v[0] + R.m[0][1] * v[1] + R.m[0][2] * v[2],
          R.m[1][0] * v[0] + R.m[1][1] * v[1] + R.m[1][2] * v[2],
          R.m[2][0] * v[0] + R.m[2][1] * v[1] + R.m[2][2] * v[2]};
}
/// R^T v without forming the transpose.
template <class S>
GRAPNEL_INLINE Vector3<S> transposed_times(const Rotation<S>& R, const Vector3<S>& v) {
  return {R.m[0][0] * v[0] + R.m[1][0] * v[1] + R.m[2][0] * v[2],
          R.m[0][1] * v[0] + R.m[1][1] * v[1] + R.m[2][1] * v[2],
          R.m[0][2] * v[0] + R.m[1][2] * v[1] + R.m[2][2] * v[2]};
}
template <class S>
GRAPNEL_INLINE Rotation<S> operator*(const Rotation<S>& A, const Rotation<S>& B) {
  Rotation<S> C;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      C.m[i][j] = A.m[i][0] * B.m[0][j] + A.m[i][1] * B.m[1][j] + A.m[i][2] * B.m[2][j];
    }
  }
  return C;
}
template <class S>
GRAPNEL_INLINE Rotation<S> transpose(const Rotation<S>& R) {
  return {{{R.m[0][0], R.m[1][0], R.m[2][0]}, {R.m[0][1], R.m[1][1], R.m[2][1]}, {R.m[0][2], R.m[1][2], R.m[2][2]}}};
}
/// R I R^T for symmetric I.
template <class S>
GRAPNEL_INLINE Symmetric3<S> rotate(const Rotation<S>& R, const Symmetric3<S>& I) {
  const Vector3<S> c0 = I * Vector3<S>{R.m[0][0], R.m[0][1], R.m[0][2]};
  const Vector3<S> c1 = I * Vector3<S>{R.m[1][0], R.m[1][1], R.m[1][2]};
  const Vector3<S> c2 = I * Vector3<S>{R.m[2][0], R.m[2][1], R.m[2][2]};
  const Vector3<S> r0{R.m[0][0], R.m[0][1], R.m[0][2]}, r1{R.m[1][0], R.m[1][1], R.m[1][2]},
      r2{R.m[2][0], R.m[2][1], R.m[2][2]};
  return {dot(r0, c0), dot(r1, c1), dot(r2, c2), dot(r0, c1), dot(r0, c2), dot(r1, c2)};
}

/// A unit quaternion (w, x, y, z): the rotation R_AB.
template <class S = double>
struct Quaternion {
  S w, x, y, z;
  static constexpr Quaternion identity() { return {S(1), S(0), S(0), S(0)}; }
};

/// Rotation matrix of a unit quaternion.
template <class S>
GRAPNEL_INLINE Rotation<S> rotation_matrix(const Quaternion<S>& q) {
  const S x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const S xx = q.x * x2, yy = q.y * y2, zz = q.z * z2, xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
  const S wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  const S one(1);
  return {
      {{one - (yy + zz), xy - wz, xz + wy}, {xy + wz, one - (xx + zz), yz - wx}, {xz - wy, yz + wx, one - (xx + yy)}}};
}

/// Time derivative of the quaternion of R_AB for the angular velocity of B in A, expressed in B: q_dot = q o (0, w)/2.
template <class S>
GRAPNEL_INLINE Quaternion<S> quaternion_rate(const Quaternion<S>& q, const Vector3<S>& w_B) {
  const S h(0.5);
  return {h * (-q.x * w_B[0] - q.y * w_B[1] - q.z * w_B[2]), h * (q.w * w_B[0] + q.y * w_B[2] - q.z * w_B[1]),
          h * (q.w * w_B[1] + q.z * w_B[0] - q.x * w_B[2]), h * (q.w * w_B[2] + q.x * w_B[1] - q.y * w_B[0])};
}

/// Product: R_AC from R_AB and R_BC.
template <class S>
GRAPNEL_INLINE Quaternion<S> operator*(const Quaternion<S>& a, const Quaternion<S>& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

using Rotationd = Rotation<double>;
using Quaterniond = Quaternion<double>;

/// Unit quaternion of a rotation matrix, w >= 0 (Shepperd's method, which starts from the largest component and is
/// accurate near half turns).
Quaterniond quaternion_from(const Rotationd& R);
/// Rotation by `angle` [rad] about the unit vector `axis`.
Rotationd rotation_about(const Vector3d& axis, double angle);
/// Rz(yaw) Ry(pitch) Rx(roll): URDF's roll-pitch-yaw about fixed axes [rad].
Rotationd rotation_from_rpy(double roll, double pitch, double yaw);
/// The smallest rotation that maps unit vector `from` onto unit vector `to`.
Rotationd rotation_between(const Vector3d& from, const Vector3d& to);
/// Angle of a rotation in [0, pi] [rad], accurate near 0 and pi.
double rotation_angle(const Rotationd& R);
/// Rotation vector (axis times angle) [rad], accurate near 0 and pi.
Vector3d rotation_vector(const Rotationd& R);

// A rigid transform. `X_AB` holds the orientation R_AB and the position p_AB of B's origin in A, expressed in A.

template <class S = double>
struct Pose {
  Rotation<S> R;
  Vector3<S> p;

  static GRAPNEL_INLINE constexpr Pose identity() { return {Rotation<S>::identity(), Vector3<S>::zero()}; }
};

/// X_AC = X_AB X_BC.
template <class S>
GRAPNEL_INLINE Pose<S> operator*(const Pose<S>& X_AB, const Pose<S>& X_BC) {
  return {X_AB.R * X_BC.R, X_AB.p + X_AB.R * X_BC.p};
}
/// Point given in B, returned in A.
template <class S>
GRAPNEL_INLINE Vector3<S> operator*(const Pose<S>& X_AB, const Vector3<S>& p_B) {
  return X_AB.p + X_AB.R * p_B;
}
/// X_BA from X_AB.
template <class S>
GRAPNEL_INLINE Pose<S> inverse(const Pose<S>& X_AB) {
  return {transpose(X_AB.R), -transposed_times(X_AB.R, X_AB.p)};
}

using Posed = Pose<double>;

}  // namespace grapnel
