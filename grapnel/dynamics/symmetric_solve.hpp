#pragma once

/// @file
/// Small positive definite systems, factored as L D L^T without square roots.

#include "grapnel/dynamics/articulated_inertia.hpp"

namespace grapnel {

/// L D L^T of a positive definite 3 x 3 matrix.
template <class S>
class SymmetricFactor3 {
 public:
  GRAPNEL_INLINE explicit SymmetricFactor3(const Symmetric3<S>& A) {
    d0_ = S(1) / A.xx;
    l10_ = A.xy * d0_, l20_ = A.xz * d0_;
    d1_ = S(1) / (A.yy - l10_ * A.xy);
    const S a21 = A.yz - l20_ * A.xy;
    l21_ = a21 * d1_;
    d2_ = S(1) / (A.zz - l20_ * A.xz - l21_ * a21);
  }
  GRAPNEL_INLINE Vector3<S> solve(const Vector3<S>& b) const {
    const S y1 = b[1] - l10_ * b[0];
    const S y2 = b[2] - l20_ * b[0] - l21_ * y1;
    const S x2 = y2 * d2_;
    const S x1 = y1 * d1_ - l21_ * x2;
    return {b[0] * d0_ - l10_ * x1 - l20_ * x2, x1, x2};
  }

 private:
  S d0_, d1_, d2_, l10_, l20_, l21_;  // d: inverse pivots
};

/// Solves I A = F. With I = [J H; H^T M]: (J - H M^-1 H^T) angular = F.angular - H M^-1 F.linear, then M linear =
/// F.linear - H^T angular.
template <class S>
GRAPNEL_INLINE SpatialAcceleration<S> solve_articulated(const ArticulatedInertia<S>& I, const Wrench<S>& F) {
  const SymmetricFactor3<S> M(I.M);
  const Vector3<S> h0{I.H[0][0], I.H[0][1], I.H[0][2]}, h1{I.H[1][0], I.H[1][1], I.H[1][2]},
      h2{I.H[2][0], I.H[2][1], I.H[2][2]};
  const Vector3<S> x0 = M.solve(h0), x1 = M.solve(h1), x2 = M.solve(h2);  // rows of H M^-1
  const SymmetricFactor3<S> schur(Symmetric3<S>{I.J.xx - dot(h0, x0), I.J.yy - dot(h1, x1), I.J.zz - dot(h2, x2),
                                                I.J.xy - dot(h0, x1), I.J.xz - dot(h0, x2), I.J.yz - dot(h1, x2)});
  const Vector3<S>& f = F.linear;
  const Vector3<S> angular = schur.solve(F.angular - Vector3<S>{dot(x0, f), dot(x1, f), dot(x2, f)});
  const Vector3<S> linear = M.solve(f - (angular[0] * h0 + angular[1] * h1 + angular[2] * h2));
  return {angular, linear};
}

/// The same for a rigid body, about its centre of mass c: I_C angular = F.angular - c x F.linear, then linear =
/// F.linear / m - angular x c. A third of the operations.
template <class S>
GRAPNEL_INLINE SpatialAcceleration<S> solve_rigid(const RigidBodyInertia<S>& I, const Wrench<S>& F) {
  const S inverse_mass = S(1) / I.mass;
  const Vector3<S> c = inverse_mass * I.first_moment;
  const SymmetricFactor3<S> I_C(I.rotational + point_mass_inertia(-I.mass, c));
  const Vector3<S> angular = I_C.solve(F.angular - cross(c, F.linear));
  return {angular, inverse_mass * F.linear - cross(angular, c)};
}

}  // namespace grapnel
