#pragma once

/// @file
/// A rigid transform. `X_AB` holds the orientation R_AB and the position p_AB of B's origin in A, expressed in A.

#include "grapnel/spatial/rotation.hpp"

namespace grapnel {

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
