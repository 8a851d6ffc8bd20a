#pragma once

/// @file
/// Products of motions and loads in the derivatives of the dynamics. Variations of twists and accelerations have one
/// type, as have those of wrenches and momenta: section 28 of docs/theory.

#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel::derivatives {

template <class S>
GRAPNEL_INLINE Twist<S> cross(const Twist<S>& V, const Twist<S>& X) {
  return {cross(V.angular, X.angular), cross(V.angular, X.linear) + cross(V.linear, X.angular)};
}
template <class S>
GRAPNEL_INLINE Wrench<S> cross_load(const Twist<S>& V, const Wrench<S>& F) {
  return {cross(V.angular, F.angular) + cross(V.linear, F.linear), cross(V.angular, F.linear)};
}
template <class S>
GRAPNEL_INLINE S product(const Twist<S>& V, const Wrench<S>& F) {
  return dot(V.angular, F.angular) + dot(V.linear, F.linear);
}
template <class S>
GRAPNEL_INLINE Wrench<S> times(const RigidBodyInertia<S>& I, const Twist<S>& X) {
  return {I.rotational * X.angular + cross(I.first_moment, X.linear),
          I.mass * X.linear + cross(X.angular, I.first_moment)};
}

}  // namespace grapnel::derivatives
