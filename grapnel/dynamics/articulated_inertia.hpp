#pragma once

/// @file
/// Articulated inertia: the inertia of a link at its joint if the joints beyond it are free to move. A symmetric 6 x 6
/// matrix [J H; H^T M] that maps spatial acceleration to wrench. Its operations dominate the cost of forward dynamics;
/// each is written out for its structure.

#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

template <class S>
struct ArticulatedInertia {
  Symmetric3<S> J;  // moment from angular acceleration
  S H[3][3];        // moment from linear acceleration; its transpose: force from angular acceleration
  Symmetric3<S> M;  // force from linear acceleration

  GRAPNEL_INLINE ArticulatedInertia& operator+=(const ArticulatedInertia& b) {
    J += b.J, M += b.M;
    GRAPNEL_UNROLL
    for (int i = 0; i < 3; ++i) {
      GRAPNEL_UNROLL
      for (int j = 0; j < 3; ++j) H[i][j] += b.H[i][j];
    }
    return *this;
  }
};

template <class S>
GRAPNEL_INLINE ArticulatedInertia<S> articulated(const RigidBodyInertia<S>& I) {
  const Vector3<S>& h = I.first_moment;
  return {I.rotational,
          {{S(0), -h[2], h[1]}, {h[2], S(0), -h[0]}, {-h[1], h[0], S(0)}},
          Symmetric3<S>::diagonal(I.mass, I.mass, I.mass)};
}

/// The same written number by number, see `loaded`.
template <class S>
GRAPNEL_INLINE void set_rigid(ArticulatedInertia<S>& I, const RigidBodyInertia<S>& R) {
  const Symmetric3<S>& J = R.rotational;
  const Vector3<S>& h = R.first_moment;
  I.J.xx = J.xx, I.J.yy = J.yy, I.J.zz = J.zz, I.J.xy = J.xy, I.J.xz = J.xz, I.J.yz = J.yz;
  I.H[0][0] = I.H[1][1] = I.H[2][2] = S(0);
  I.H[0][1] = -h[2], I.H[0][2] = h[1], I.H[1][0] = h[2], I.H[1][2] = -h[0], I.H[2][0] = -h[1], I.H[2][1] = h[0];
  I.M.xx = I.M.yy = I.M.zz = R.mass, I.M.xy = I.M.xz = I.M.yz = S(0);
}

/// Sum of the rigid inertia of a link and the inertia passed on by its first child, number by number. In the rigid
/// inertia, H is skew and M a multiple of the identity.
template <class S>
GRAPNEL_INLINE void set_sum(ArticulatedInertia<S>& sum, const RigidBodyInertia<S>& R, const ArticulatedInertia<S>& I) {
  const Symmetric3<S>& J = R.rotational;
  const Vector3<S>& h = R.first_moment;
  sum.J.xx = J.xx + I.J.xx, sum.J.yy = J.yy + I.J.yy, sum.J.zz = J.zz + I.J.zz;
  sum.J.xy = J.xy + I.J.xy, sum.J.xz = J.xz + I.J.xz, sum.J.yz = J.yz + I.J.yz;
  sum.H[0][0] = I.H[0][0], sum.H[0][1] = I.H[0][1] - h[2], sum.H[0][2] = I.H[0][2] + h[1];
  sum.H[1][0] = I.H[1][0] + h[2], sum.H[1][1] = I.H[1][1], sum.H[1][2] = I.H[1][2] - h[0];
  sum.H[2][0] = I.H[2][0] - h[1], sum.H[2][1] = I.H[2][1] + h[0], sum.H[2][2] = I.H[2][2];
  sum.M.xx = I.M.xx + R.mass, sum.M.yy = I.M.yy + R.mass, sum.M.zz = I.M.zz + R.mass;
  sum.M.xy = I.M.xy, sum.M.xz = I.M.xz, sum.M.yz = I.M.yz;
}

/// Copies number by number. Numbers stored individually must be loaded individually: a block copy would wait for the
/// store buffer (10 ns per link).
template <class S>
GRAPNEL_INLINE ArticulatedInertia<S> loaded(const ArticulatedInertia<S>& I) {
  return {{I.J.xx, I.J.yy, I.J.zz, I.J.xy, I.J.xz, I.J.yz},
          {{I.H[0][0], I.H[0][1], I.H[0][2]}, {I.H[1][0], I.H[1][1], I.H[1][2]}, {I.H[2][0], I.H[2][1], I.H[2][2]}},
          {I.M.xx, I.M.yy, I.M.zz, I.M.xy, I.M.xz, I.M.yz}};
}

template <class S>
GRAPNEL_INLINE Wrench<S> operator*(const ArticulatedInertia<S>& I, const SpatialAcceleration<S>& A) {
  const Vector3<S>& a = A.angular;
  const Vector3<S>& l = A.linear;
  Wrench<S> F{I.J * a, I.M * l};
  GRAPNEL_UNROLL
  for (int i = 0; i < 3; ++i) {
    F.angular[i] += I.H[i][0] * l[0] + I.H[i][1] * l[1] + I.H[i][2] * l[2];
    F.linear[i] += I.H[0][i] * a[0] + I.H[1][i] * a[1] + I.H[2][i] * a[2];
  }
  return F;
}

/// Transformed to a frame with the same axes whose origin is at -p; the old origin is at p in the new frame.
///   H' = H + [p x] M,   J' = J - H [p x] + [p x] H'^T.
template <class S>
GRAPNEL_INLINE void shift_origin(ArticulatedInertia<S>& I, const Vector3<S>& p) {
  // Rows of H before the shift, and p x rows: (-H [p x])_(r,c) = (p x H_r)_c.
  const Vector3<S> h0{I.H[0][0], I.H[0][1], I.H[0][2]}, h1{I.H[1][0], I.H[1][1], I.H[1][2]},
      h2{I.H[2][0], I.H[2][1], I.H[2][2]};
  const Symmetric3<S>& M = I.M;
  // [p x] M, by columns of M.
  const Vector3<S> m0 = cross(p, Vector3<S>{M.xx, M.xy, M.xz}), m1 = cross(p, Vector3<S>{M.xy, M.yy, M.yz}),
                   m2 = cross(p, Vector3<S>{M.xz, M.yz, M.zz});
  GRAPNEL_UNROLL
  for (int i = 0; i < 3; ++i) I.H[i][0] += m0[i], I.H[i][1] += m1[i], I.H[i][2] += m2[i];
  const Vector3<S> n0{I.H[0][0], I.H[0][1], I.H[0][2]}, n1{I.H[1][0], I.H[1][1], I.H[1][2]},
      n2{I.H[2][0], I.H[2][1], I.H[2][2]};
  // J'_(r,c) = J_(r,c) + (p x h_r)_c + (p x n_c)_r.
  I.J.xx += (p[1] * h0[2] - p[2] * h0[1]) + (p[1] * n0[2] - p[2] * n0[1]);
  I.J.yy += (p[2] * h1[0] - p[0] * h1[2]) + (p[2] * n1[0] - p[0] * n1[2]);
  I.J.zz += (p[0] * h2[1] - p[1] * h2[0]) + (p[0] * n2[1] - p[1] * n2[0]);
  I.J.xy += (p[2] * h0[0] - p[0] * h0[2]) + (p[1] * n1[2] - p[2] * n1[1]);
  I.J.xz += (p[0] * h0[1] - p[1] * h0[0]) + (p[1] * n2[2] - p[2] * n2[1]);
  I.J.yz += (p[0] * h1[1] - p[1] * h1[0]) + (p[2] * n2[0] - p[0] * n2[2]);
}

/// Likewise for an articulated inertia passed on by a revolute joint about axis K: J_K* = 0, H_K* = 0.
template <int K, class S>
GRAPNEL_INLINE void shift_behind_joint(ArticulatedInertia<S>& I, const Vector3<S>& p) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  const Vector3<S> hi{I.H[i][0], I.H[i][1], I.H[i][2]}, hj{I.H[j][0], I.H[j][1], I.H[j][2]};
  // [p x] M, by its rows: row i is p_j M_K - p_K M_j and so on cyclically.
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) {
    I.H[K][c] = p[i] * I.M(j, c) - p[j] * I.M(i, c);
    I.H[i][c] += p[j] * I.M(K, c) - p[K] * I.M(j, c);
    I.H[j][c] += p[K] * I.M(i, c) - p[i] * I.M(K, c);
  }
  const auto& n = I.H;  // after the shift
  // J'_(r,c) = J_(r,c) + (p x h_r)_c + (p x n_c)_r, with h_K = 0 and J_K* = 0.
  I.J(K, K) = p[i] * n[K][j] - p[j] * n[K][i];
  I.J(i, K) = p[i] * n[i][j] - p[j] * n[i][i];
  I.J(j, K) = p[i] * n[j][j] - p[j] * n[j][i];
  I.J(i, i) += (p[j] * hi[K] - p[K] * hi[j]) + (p[j] * n[i][K] - p[K] * n[i][j]);
  I.J(j, j) += (p[K] * hj[i] - p[i] * hj[K]) + (p[K] * n[j][i] - p[i] * n[j][K]);
  I.J(i, j) += (p[K] * hi[i] - p[i] * hi[K]) + (p[j] * n[j][K] - p[K] * n[j][j]);
}

/// Re-expressed by a general rotation: R J R^T, R H R^T, R M R^T.
template <class S>
GRAPNEL_INLINE void rotate_general(ArticulatedInertia<S>& I, const Rotation<S>& R) {
  I.J = rotate(R, I.J);
  I.M = rotate(R, I.M);
  S T[3][3];
  GRAPNEL_UNROLL
  for (int i = 0; i < 3; ++i) {
    GRAPNEL_UNROLL
    for (int j = 0; j < 3; ++j) T[i][j] = R.m[i][0] * I.H[0][j] + R.m[i][1] * I.H[1][j] + R.m[i][2] * I.H[2][j];
  }
  GRAPNEL_UNROLL
  for (int i = 0; i < 3; ++i) {
    GRAPNEL_UNROLL
    for (int j = 0; j < 3; ++j) I.H[i][j] = T[i][0] * R.m[j][0] + T[i][1] * R.m[j][1] + T[i][2] * R.m[j][2];
  }
}

/// Rotates a vector by (sine, cosine) about coordinate axis K.
template <int K, class S>
GRAPNEL_INLINE Vector3<S> rotate_about(const SineCosine<S>& a, const Vector3<S>& x) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  Vector3<S> y;
  y[K] = x[K];
  y[i] = a.cosine * x[i] - a.sine * x[j];
  y[j] = a.sine * x[i] + a.cosine * x[j];
  return y;
}
/// The inverse rotation.
template <int K, class S>
GRAPNEL_INLINE Vector3<S> rotate_back_about(const SineCosine<S>& a, const Vector3<S>& x) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  Vector3<S> y;
  y[K] = x[K];
  y[i] = a.cosine * x[i] + a.sine * x[j];
  y[j] = a.cosine * x[j] - a.sine * x[i];
  return y;
}

/// Rotates the (i, j) block of a symmetric matrix about axis K; the caller handles the K entries.
template <int K, class S>
GRAPNEL_INLINE void rotate_block_about(const SineCosine<S>& a, Symmetric3<S>& A) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  // With t = s (A_ii - A_jj) + 2 c A_ij:  A_ii' = A_ii - s t, A_jj' = A_jj + s t, and A_ij' = c t - A_ij.
  const S t = a.sine * (A(i, i) - A(j, j)) + (a.cosine + a.cosine) * A(i, j);
  const S st = a.sine * t;
  A(i, i) -= st;
  A(j, j) += st;
  A(i, j) = a.cosine * t - A(i, j);
}

/// Re-expressed after a rotation about axis K.
template <int K, class S>
GRAPNEL_INLINE void rotate_about(const SineCosine<S>& a, Symmetric3<S>& A) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  const S ai = A(i, K), aj = A(j, K);
  rotate_block_about<K>(a, A);
  A(i, K) = a.cosine * ai - a.sine * aj;
  A(j, K) = a.sine * ai + a.cosine * aj;
}

/// Likewise for the rows i and j of H; row K is zero or handled by the caller.
template <int K, class S>
GRAPNEL_INLINE void rotate_rows_about(const SineCosine<S>& a, S (&H)[3][3]) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  S hi[3], hj[3];
  GRAPNEL_UNROLL
  for (int c = 0; c < 3; ++c) {
    hi[c] = a.cosine * H[i][c] - a.sine * H[j][c];
    hj[c] = a.sine * H[i][c] + a.cosine * H[j][c];
  }
  H[i][K] = hi[K];
  H[j][K] = hj[K];
  H[i][i] = a.cosine * hi[i] - a.sine * hi[j];
  H[i][j] = a.sine * hi[i] + a.cosine * hi[j];
  H[j][i] = a.cosine * hj[i] - a.sine * hj[j];
  H[j][j] = a.sine * hj[i] + a.cosine * hj[j];
}

/// Re-expressed after a rotation about axis K, for a general structure.
template <int K, class S>
GRAPNEL_INLINE void rotate_about(const SineCosine<S>& a, ArticulatedInertia<S>& I) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  rotate_about<K>(a, I.J);
  rotate_about<K>(a, I.M);
  rotate_rows_about<K>(a, I.H);
  const S row_i = I.H[K][i], row_j = I.H[K][j];
  I.H[K][i] = a.cosine * row_i - a.sine * row_j;
  I.H[K][j] = a.sine * row_i + a.cosine * row_j;
}

}  // namespace grapnel
